"""Links: udp, tcp and serial pty, and the channels on them. Bytes and frames only, no behaviour.

A channel is one conversation: one remote address of a bound UDP socket, one TCP connection, one
serial line. It owns the MAVLink encoder and parser (sequence numbers; later, signing), and both
directions pass through the faults.
"""

import asyncio
import fcntl
import os
import struct
import termios
import tty
from collections import deque

from .dialect import mavlink

MOST_UDP_PEERS = 16
SERIAL_QUEUE_BYTES = 256 * 1024
SERIAL_CHUNK = 32


class Wire:
    """One direction of a channel: applies a fault verdict while keeping the order of frames."""

    def __init__(self, loop):
        self.loop = loop
        self.last_due = 0.0

    def push(self, payload, verdict, deliver):
        now = self.loop.time()
        for _ in range(verdict.copies):
            if verdict.hold_s:  # overtaken by what comes after
                self.loop.call_later(verdict.delay_s + verdict.hold_s, deliver, payload)
                continue
            due = now + verdict.delay_s
            if due <= now and self.last_due <= now:
                deliver(payload)
                continue
            self.last_due = max(due, self.last_due + 1e-6)
            self.loop.call_at(self.last_due, deliver, payload)


class Channel:
    """One conversation. `write` takes bytes; `vehicle` gets what comes in."""

    def __init__(self, vehicle, link, name, write):
        self.vehicle, self.link, self.name, self.write = vehicle, link, name, write
        self.mav = mavlink.MAVLink(None, srcSystem=vehicle.sysid, srcComponent=mavlink.MAV_COMP_ID_AUTOPILOT1)
        self.mav.robust_parsing = True
        vehicle.signing.secure(self.mav, link.number)
        self.heard = {}      # (system, component) of everybody heard here, oldest first
        self.intervals = {}  # message id -> timer, see telemetry
        self.incoming, self.outgoing = Wire(vehicle.loop), Wire(vehicle.loop)
        self.closed = False
        self.counts = {"rx": 0, "tx": 0, "rx_bad": 0, "rx_lost": 0, "tx_lost": 0}

    def send(self, message):
        """Encodes and sends, unless the vehicle is down."""
        if self.vehicle.down:
            return
        frame = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        self.send_frame(message.get_type(), bytes(frame))

    def send_frame(self, name, frame):
        """Sends a finished frame (also used to forward those of others)."""
        faults = self.vehicle.faults
        verdict = faults.frame("tx", name, self.link.number)
        if verdict.noise_bytes:
            self.write(faults.random.randbytes(verdict.noise_bytes))
        if verdict.lost:
            self.counts["tx_lost"] += 1
            return
        if verdict.corrupt:
            frame = faults.corrupted(frame)
        self.counts["tx"] += 1
        self.outgoing.push(frame, verdict, self.write)

    def statustext(self, severity, text):
        self.send(mavlink.MAVLink_statustext_message(severity, text.encode()[:50]))

    def receive(self, data):
        """Takes bytes off the link."""
        try:
            messages = self.mav.parse_buffer(data) or []
        except Exception:  # pymavlink raises several kinds on hostile bytes; the link has to live on
            self.mav.buf, self.mav.buf_index, self.mav.expected_length = bytearray(), 0, 8
            self.counts["rx_bad"] += 1
            return
        for message in messages:
            name = message.get_type()
            if name == "BAD_DATA" or name.startswith("UNKNOWN"):
                self.counts["rx_bad"] += 1
                continue
            self.counts["rx"] += 1
            verdict = self.vehicle.faults.frame("rx", name, self.link.number)
            if verdict.lost or verdict.corrupt:
                self.counts["rx_lost"] += 1
                continue
            self.incoming.push(message, verdict, self._deliver)

    def _deliver(self, message):
        if not (self.vehicle.down or self.closed):
            self.vehicle.receive(self, message)

    def close(self):
        self.closed = True
        self.vehicle.channel_closed(self)


class Link:
    """Something opened with --link. Subclasses open it and add channels to the vehicle."""

    def __init__(self, vehicle, number):
        self.vehicle, self.number = vehicle, number

    async def open(self):
        raise NotImplementedError

    def describe(self):
        """For the ready line: kind, where, and the URL with which to connect to it."""
        raise NotImplementedError

    def rebooted(self, close_connections):
        """What a reboot of the vehicle does to the link."""

    async def close(self):
        pass


class UdpLink(Link, asyncio.DatagramProtocol):
    """`udpout`: talks to HOST:PORT from the start. `udpin`: binds, and talks to whoever spoke."""

    def __init__(self, vehicle, number, kind, host, port):
        super().__init__(vehicle, number)
        self.kind, self.host, self.port = kind, host, port
        self.channels = {}  # remote address -> Channel

    async def open(self):
        address = (self.host, self.port)
        where = {"remote_addr": address} if self.kind == "udpout" else {"local_addr": address}
        self.transport, _ = await self.vehicle.loop.create_datagram_endpoint(lambda: self, **where)
        if self.kind == "udpout":
            self._channel(None)
        else:
            self.port = self.transport.get_extra_info("sockname")[1]

    def _channel(self, address):
        channel = self.channels.get(address)
        if channel is None:
            if len(self.channels) >= MOST_UDP_PEERS:
                self.channels.pop(next(iter(self.channels))).close()
            name = f"{self.kind}:{self.host}:{self.port}" if address is None else f"udpin:{address[0]}:{address[1]}"
            channel = Channel(self.vehicle, self, name, lambda data: self._write(data, address))
            self.channels[address] = channel
            self.vehicle.channel_opened(channel)
        return channel

    def _write(self, data, address):
        if not self.transport.is_closing():
            self.transport.sendto(data, address)

    def datagram_received(self, data, addr):
        self._channel(None if self.kind == "udpout" else addr).receive(data)

    def error_received(self, exc):
        pass  # nobody listens there yet

    def rebooted(self, close_connections):
        if self.kind == "udpin":  # the addresses of those who spoke were in memory
            for channel in self.channels.values():
                channel.close()
            self.channels.clear()

    def describe(self):
        other = "udpout" if self.kind == "udpin" else "udpin"
        host = _reachable(self.host) if self.kind == "udpin" else self.host
        return {"kind": self.kind, "host": self.host, "port": self.port, "connect": f"{other}:{host}:{self.port}"}

    async def close(self):
        self.transport.close()


class TcpLink(Link):
    """`tcpin`: a server for any number of clients. `tcpout`: connects, again and again if need be."""

    def __init__(self, vehicle, number, kind, host, port):
        super().__init__(vehicle, number)
        self.kind, self.host, self.port = kind, host, port
        self.writers, self.tasks = set(), set()
        self.server = None

    async def open(self):
        if self.kind == "tcpin":
            self.server = await asyncio.start_server(self._connected, self.host, self.port)
            self.port = self.server.sockets[0].getsockname()[1]
        else:
            self.tasks.add(self.vehicle.loop.create_task(self._connect_for_ever()))

    async def _connect_for_ever(self):
        while True:
            try:
                await self._converse(*await asyncio.open_connection(self.host, self.port))
            except OSError:
                pass
            await asyncio.sleep(0.5)

    def _connected(self, reader, writer):
        task = self.vehicle.loop.create_task(self._converse(reader, writer))
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    async def _converse(self, reader, writer):
        remote = writer.get_extra_info("peername")
        self.writers.add(writer)

        def write(data):
            # A client that does not read is not worth memory: drop, as a full serial port would.
            if not writer.is_closing() and writer.transport.get_write_buffer_size() < SERIAL_QUEUE_BYTES:
                writer.write(data)

        channel = Channel(self.vehicle, self, f"{self.kind}:{remote[0]}:{remote[1]}", write)
        self.vehicle.channel_opened(channel)
        try:
            while data := await reader.read(4096):
                channel.receive(data)
        except OSError:
            pass
        finally:
            channel.close()
            self.writers.discard(writer)
            writer.close()

    def describe(self):
        other = "tcpout" if self.kind == "tcpin" else "tcpin"
        host = _reachable(self.host) if self.kind == "tcpin" else self.host
        return {"kind": self.kind, "host": self.host, "port": self.port, "connect": f"{other}:{host}:{self.port}"}

    def rebooted(self, close_connections):
        if close_connections:
            self._close_connections()

    def _close_connections(self):
        for writer in list(self.writers):
            writer.close()

    async def close(self):
        if self.server:
            self.server.close()
        for task in self.tasks:
            task.cancel()


class PtyLink(Link):
    """A serial line: the slave side of a pty in raw mode, optionally under a chosen path.

    With `baud`, both directions move no more than baud / 10 bytes a second, as a UART would. Timers
    of this program are late by a millisecond, and by more on a busy machine; a line is not. So what
    an event is late is given back to what follows from it: an answer begins to cross when the request
    was due, and bytes that come after a frame was delivered late are taken to have come that much
    earlier.
    """

    def __init__(self, vehicle, number, path=None, baud=None):
        super().__init__(vehicle, number)
        self.symlink, self.baud = path, baud
        self.queue, self.queued, self.writing = deque(), 0, False
        self.unread_before = self.written = 0
        self.incoming_free = self.outgoing_free = 0.0
        self.arrival_late = 0.0   # of what is being received at this moment
        self.delivery_late = 0.0  # of the last frame that was delivered, until bytes come

    async def open(self):
        # The slave stays open here too: its raw mode must not be lost when the peer closes it.
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self.slave)
        if self.symlink:
            if os.path.islink(self.symlink):
                os.unlink(self.symlink)
            os.symlink(self.path, self.symlink)
        self.channel = Channel(self.vehicle, self, f"pty:{self.path}", self._write)
        self.vehicle.channel_opened(self.channel)
        self.vehicle.loop.add_reader(self.master, self._readable)
        self.vehicle.loop.call_later(1.0, self._flush_if_unread)

    def _readable(self):
        """Bytes have come to a line that was at rest."""
        data = self._read()
        if not data:
            return
        if not self.baud:
            self.channel.receive(data)
            return
        self.vehicle.loop.remove_reader(self.master)
        self.incoming_free = max(self.vehicle.loop.time() - self.delivery_late, self.incoming_free)
        self.delivery_late = 0.0
        self._cross(data)

    def _read(self):
        try:
            return os.read(self.master, 4096 if not self.baud else SERIAL_CHUNK)
        except (BlockingIOError, InterruptedError):
            pass
        except OSError:
            self.vehicle.loop.remove_reader(self.master)
        return b""

    def _cross(self, data):
        """The bytes are there when the last of them has crossed the line; meanwhile nothing is read."""
        self.incoming_free += self._crossing_s(data)
        self.vehicle.loop.call_at(self.incoming_free, self._arrived, data)

    def _arrived(self, data):
        if self.master is None:
            return
        late = self.vehicle.loop.time() - self.incoming_free
        waiting = self._read()
        if waiting:  # they follow without a gap
            self._cross(waiting)
        else:
            self.vehicle.loop.add_reader(self.master, self._readable)
        self.arrival_late = late
        self.channel.receive(data)
        self.arrival_late = 0.0

    def _crossing_s(self, data):
        return len(data) * 10 / self.baud

    def _write(self, data):
        if self.master is None or self.queued + len(data) > SERIAL_QUEUE_BYTES:
            return
        self.queue.append(data)
        self.queued += len(data)
        if not self.writing:
            self.outgoing_free = max(self.vehicle.loop.time() - self.arrival_late, self.outgoing_free)
            self._next_frame()

    def _next_frame(self):
        """Starts the frame at the head of the queue; it is written when it has crossed the line."""
        self.writing = bool(self.queue)
        if not self.writing:
            return
        if self.baud:
            self.outgoing_free += self._crossing_s(self.queue[0])
            self.vehicle.loop.call_at(self.outgoing_free, self._put)
        else:
            self._put()

    def _put(self):
        if self.master is None or not self.queue:
            self.writing = False
            return
        frame = self.queue.popleft()
        try:
            written = os.write(self.master, frame)
        except (BlockingIOError, InterruptedError):
            written = 0
        except OSError:
            written = len(frame)
        self.queued -= written
        self.written += written
        self.delivery_late = 0.0
        if written < len(frame):  # the reader is slow: wait for room
            self.queue.appendleft(frame[written:])
            self.vehicle.loop.call_later(0.005, self._put)
        elif self.queue and not self.baud:
            self.vehicle.loop.call_soon(self._put)
        else:
            if self.baud:
                self.delivery_late = self.vehicle.loop.time() - self.outgoing_free
            self._next_frame()

    def _flush_if_unread(self):
        """Nobody reads the other end: throw away what waits there, as a UART would have done."""
        if self.master is None:
            return
        unread = struct.unpack("i", fcntl.ioctl(self.slave, termios.FIONREAD, b"\0" * 4))[0]
        taken = self.unread_before + self.written - unread
        if self.unread_before > 0 and taken <= 0:
            termios.tcflush(self.slave, termios.TCIFLUSH)
            self.queue.clear()
            self.queued = unread = 0
        self.unread_before, self.written = unread, 0
        self.vehicle.loop.call_later(1.0, self._flush_if_unread)

    def describe(self):
        path = self.symlink or self.path
        return {"kind": "pty", "path": self.path, "symlink": self.symlink,
                "connect": f"serial:{path}:{self.baud or 57600}"}

    async def close(self):
        self.vehicle.loop.remove_reader(self.master)
        if self.symlink and os.path.islink(self.symlink) and os.readlink(self.symlink) == self.path:
            os.unlink(self.symlink)
        os.close(self.master)
        os.close(self.slave)
        self.master = None


def _reachable(host):
    return {"0.0.0.0": "127.0.0.1", "": "127.0.0.1", "::": "::1"}.get(host, host)


def make_link(vehicle, number, url, baud=None):
    """`udpin|udpout|tcpin|tcpout:HOST:PORT` or `pty[:PATH]`; raises ValueError."""
    kind, _, rest = url.partition(":")
    if kind == "pty":
        return PtyLink(vehicle, number, rest or None, baud)
    classes = {"udpin": UdpLink, "udpout": UdpLink, "tcpin": TcpLink, "tcpout": TcpLink}
    host, colon, port = rest.rpartition(":")
    if kind not in classes or not colon or not port.isdigit() or int(port) > 65535:
        raise ValueError(f"{url!r} is not udpin|udpout|tcpin|tcpout:HOST:PORT nor pty[:PATH]")
    if kind.endswith("out") and (int(port) == 0 or not host):
        raise ValueError(f"{url!r} needs a host and a port to send to")
    return classes[kind](vehicle, number, kind, host or "0.0.0.0", int(port))
