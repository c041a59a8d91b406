"""HTTP requests that prove that who sends them has the robot's key, and answers that prove the same. No I/O, no clock.

    pilot   GET PATH
    robot   401, WWW-Authenticate: Robot-Key challenge="C"
    pilot   METHOD PATH, Authorization: Robot-Key challenge="C", nonce="N", proof="P"; the body
    robot   the answer, Authentication-Info: proof="Q"

P is the HMAC of method, path with query, C, N, content type and body; Q that of P, status, Location, content type and
body. So an offer and its answer, with the fingerprints of their certificates, come from who has the key, and nobody
changed them; neither can be used a second time, on another path or with another robot.

A challenge carries its own time and seal: who asks for thousands of them makes the robot remember none.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from typing import NamedTuple

from telepresence.security.robot_key import RobotKey

SCHEME = "Robot-Key"
LIFETIME = 10.0
"""Seconds for which a challenge can be answered."""
MAX_HEADER = 512
"""Characters of a header that is looked at."""
_CHALLENGE = re.compile(r"([0-9a-f]{28})([0-9a-f]{32})", re.ASCII)
_FIELD = re.compile(r'(challenge|nonce|proof)="([0-9a-f]{1,64})"', re.ASCII)


class Request(NamedTuple):
    """What is proven of a request. `path` has the query with it, as it stands in the request."""

    method: str
    path: str
    content_type: str = ""
    body: bytes = b""


class Answer(NamedTuple):
    """What is proven of an answer."""

    status: int
    location: str = ""
    content_type: str = ""
    body: bytes = b""


class Credentials(NamedTuple):
    """What a request's Authorization says."""

    challenge: str
    nonce: str
    proof: bytes


class Challenges:
    """The robot's challenges; each is good for one request.

    Args:
        lifetime: Seconds for which one can be answered.
    """

    def __init__(self, lifetime: float = LIFETIME) -> None:
        self._lifetime = lifetime
        self._secret = secrets.token_bytes(32)
        self._used: dict[str, float] = {}

    def new(self, now: float) -> str:
        """Return another one, 60 digits.

        Args:
            now: Monotonic time [s].
        """
        head = f"{round(now * 1000):012x}{secrets.token_hex(8)}"
        return head + self._seal(head)

    def fresh(self, challenge: str, now: float) -> bool:
        """Whether it is one of these, young enough, and not used."""
        parts = _CHALLENGE.fullmatch(challenge)
        if parts is None or not hmac.compare_digest(parts[2], self._seal(parts[1])):
            return False
        return -0.001 <= now - int(parts[1][:12], 16) / 1000 <= self._lifetime and challenge not in self._used

    def use(self, challenge: str, now: float) -> bool:
        """Take it out of use; False if it was so already. Only for requests that are proven: each costs memory."""
        for old in [each for each, since in self._used.items() if now - since > self._lifetime]:
            del self._used[old]
        if not self.fresh(challenge, now):
            return False
        self._used[challenge] = now
        return True

    def _seal(self, head: str) -> str:
        return hmac.new(self._secret, head.encode(), hashlib.sha256).hexdigest()[:32]


def ask_for_proof(challenge: str) -> str:
    """The value of WWW-Authenticate."""
    return f'{SCHEME} challenge="{challenge}"'


def challenge_in(header: str) -> str | None:
    """The challenge in WWW-Authenticate; None if there is none."""
    return _fields(header).get("challenge") if header.startswith(SCHEME) else None


def authorization(key: RobotKey, request: Request, challenge: str) -> tuple[str, bytes]:
    """The value of Authorization, and the proof in it, which the answer's proof holds."""
    nonce = secrets.token_hex(16)
    proof = _proof(key, request, challenge, nonce)
    return f'{SCHEME} challenge="{challenge}", nonce="{nonce}", proof="{proof.hex()}"', proof


def credentials_in(header: str) -> Credentials | None:
    """What an Authorization says; None if it is none of this kind."""
    fields = _fields(header) if header.startswith(SCHEME) else {}
    if len(fields) != 3 or len(fields["proof"]) != 64:
        return None
    return Credentials(fields["challenge"], fields["nonce"], bytes.fromhex(fields["proof"]))


def proven(key: RobotKey, request: Request, credentials: Credentials) -> bool:
    """Whether who made the credentials for this request has the key."""
    wanted = _proof(key, request, credentials.challenge, credentials.nonce)
    return hmac.compare_digest(credentials.proof, wanted)


def answer_proof(key: RobotKey, request_proof: bytes, answer: Answer) -> str:
    """The value of Authentication-Info."""
    return f'proof="{_answer_mac(key, request_proof, answer).hex()}"'


def answer_proven(key: RobotKey, request_proof: bytes, answer: Answer, header: str) -> bool:
    """Whether the answer is to the request with that proof, from who has the key."""
    proof = _fields(header).get("proof", "")
    return hmac.compare_digest(proof, _answer_mac(key, request_proof, answer).hex())


def _proof(key: RobotKey, request: Request, challenge: str, nonce: str) -> bytes:
    words = (request.method, request.path, challenge, nonce, request.content_type)
    return key.mac("signaling request", *map(_as_bytes, words), request.body)


def _answer_mac(key: RobotKey, request_proof: bytes, answer: Answer) -> bytes:
    words = (str(answer.status), answer.location, answer.content_type)
    return key.mac("signaling answer", request_proof, *map(_as_bytes, words), answer.body)


def _as_bytes(text: str) -> bytes:
    """Encode a header or a path of a stranger; aiohttp hands over as surrogates what is no UTF-8."""
    return text.encode("utf-8", "surrogateescape")


def _fields(header: str) -> dict[str, str]:
    return dict(_FIELD.findall(header)) if len(header) <= MAX_HEADER else {}
