"""Servers that help through the internet: STUN says how we look from outside, TURN carries what no direct way does.

A browser gets a name and a password of the relay for an hour, made here of a secret that the relay has, too; nothing is
registered anywhere. Source: draft-uberti-behave-turn-rest-00, 2.2; coturn's option `use-auth-secret`.

    user name   <end of validity, Unix time [s]>:<name>
    password    base64(HMAC-SHA1(secret, user name))

The page asks nobody but these servers, and none unless it is set up: by default all are in one network.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from aiortc import RTCIceServer

LIFE = 3600
"""[s] for which a browser may open ways through the relay. Every answer to an offer brings a new hour; a page whose
answer is older than three quarters of that asks anew."""
_URI = re.compile(r"(stun|turn|turns):(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9.-]+)(:\d{1,5})?(\?transport=(?:udp|tcp))?")
"""RFC 7064, RFC 7065."""
_LEAST_SECRET = 16


class Relays:
    """What a page tells browsers about these servers.

    Args:
        uris: `stun:HOST[:PORT]`, `turn:HOST[:PORT][?transport=udp|tcp]`, `turns:...`. A relay without a transport is
            tried by both; it answers as a STUN server, too.
        secret: Shared with the relay; needed with `turn:`.
    Raises:
        ValueError: With a sentence: a URI is invalid, or there is no secret.
    """

    def __init__(self, uris: Sequence[str] = (), secret: str = "") -> None:
        self._secret = secret.encode()
        self._stun: list[str] = []
        self._turn: list[str] = []
        for uri in uris:
            found = _URI.fullmatch(uri)
            if found is None or (found[1] == "stun" and found[4]):
                raise ValueError(f"{uri!r} is no stun:HOST:PORT, turn:HOST:PORT or turns:HOST:PORT")
            scheme, host, port, transport = found.groups(default="")
            if scheme == "stun":
                self._stun.append(uri)
            elif scheme == "turns" or transport:
                self._turn.append(uri if transport else f"{uri}?transport=tcp")
            else:
                self._turn += [f"{uri}?transport=udp", f"{uri}?transport=tcp"]
            if scheme == "turn":
                self._stun.append(f"stun:{host}{port}")
        if self._turn and len(secret) < _LEAST_SECRET:
            raise ValueError(
                f"a relay needs a secret of {_LEAST_SECRET} characters or more, the one that it has itself"
            )

    @classmethod
    def read(cls, uris: Sequence[str], secret_file: Path | None) -> Relays:
        """Return them with the secret that is the first line of a file: command lines are read by everybody.

        Raises:
            ValueError: See `Relays`.
            OSError: The file cannot be read.
        """
        lines = secret_file.read_text().splitlines() if secret_file is not None else []
        return cls(uris, lines[0].strip() if lines else "")

    def for_browser(self, name: str, now: float) -> list[dict[str, Any]]:
        """Return JavaScript's `iceServers` for one browser.

        Args:
            name: What the relay's log calls it; not its person's.
            now: Unix time [s].
        """
        servers: list[dict[str, Any]] = [{"urls": self._stun}] if self._stun else []
        if self._turn:
            user = f"{int(now) + LIFE}:{name}"
            password = base64.b64encode(hmac.digest(self._secret, user.encode(), hashlib.sha1)).decode()
            servers.append({"urls": self._turn, "username": user, "credential": password})
        return servers

    def for_station(self) -> list[RTCIceServer]:
        """Return what this end asks for its address from outside: a relay lets nobody through whom it was not named.

        It needs no relay of its own, as it reaches the browser's.
        """
        return [RTCIceServer(self._stun[:1])] if self._stun else []
