"""IAM: API keys for bearer tokens, JWTs with `iat` and `exp`."""

import base64
import json
import secrets
import time


def _part(document):
    return base64.urlsafe_b64encode(json.dumps(document).encode()).rstrip(b"=").decode()


class Tokens:
    def __init__(self, key, life):
        self.key, self.life = key, life
        self.expiry = {}

    def grant(self, key):
        """The token document; `None` for a key that is not known."""
        if key != self.key:
            return None
        now = time.time()
        claims = {"iat": int(now), "exp": int(now + self.life), "iam_id": "IBMid-stub", "jti": secrets.token_hex(8)}
        token = ".".join([_part({"alg": "RS256", "typ": "JWT"}), _part(claims), secrets.token_urlsafe(32)])
        self.expiry[token] = now + self.life
        return {"access_token": token, "refresh_token": "not_supported", "token_type": "Bearer",
                "expires_in": self.life, "expiration": int(now + self.life), "scope": "ibm openid"}

    def valid(self, authorization):
        scheme, _, token = (authorization or "").partition(" ")
        return scheme == "Bearer" and self.expiry.get(token, 0) > time.time()

    def revoke_all(self):
        self.expiry.clear()
