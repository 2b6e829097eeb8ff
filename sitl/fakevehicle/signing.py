"""MAVLink 2 signing of a channel's encoder and parser, by pymavlink's own implementation."""

import time

MAVLINK_EPOCH = 1420070400  # 2015-01-01 UTC; stamps count 10 us from there


class Signing:
    """Without a key nothing is signed and everything is taken."""

    def __init__(self, key=None, accept_unsigned=False):
        self.key, self.accept_unsigned = key, accept_unsigned
        self.streams = {}  # newest stamp of each (link id, system, component), shared by all channels

    @classmethod
    def from_file(cls, path, accept_unsigned):
        """The key is 32 raw bytes or 64 hex digits; raises OSError or ValueError."""
        if path is None:
            return cls()
        with open(path, "rb") as file:
            key = file.read(4096)
        if len(key) != 32:
            try:
                key = bytes.fromhex(key.decode("ascii").strip())
            except ValueError as error:
                raise ValueError(f"{path}: neither 32 bytes nor 64 hex digits") from error
        if len(key) != 32:
            raise ValueError(f"{path}: the key has {len(key)} bytes, not 32")
        return cls(key, accept_unsigned)

    def secure(self, mav, link_number):
        """Sets up one channel's MAVLink object."""
        if self.key is None:
            return
        mav.signing.secret_key = self.key
        mav.signing.link_id = link_number & 0xFF
        mav.signing.timestamp = int((time.time() - MAVLINK_EPOCH) * 1e5)
        mav.signing.sign_outgoing = True
        mav.signing.stream_timestamps = self.streams
        mav.signing.allow_unsigned_callback = lambda _mav, _message_id: self.accept_unsigned
