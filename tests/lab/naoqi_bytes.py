"""NAOqi's messages by hand, with nothing of either library: what recorded clients sent, and what strangers send."""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from types import TracebackType
from typing import NamedTuple

MAGIC = b"\x42\xde\xad\x42"
HEADER = struct.Struct("<4sIIHBBIII")
CALL, REPLY, ERROR, POST, EVENT, CAPABILITY, CANCEL, CANCELED = range(1, 9)
PATIENCE = 20.0
"""Seconds after which an answer counts as never coming."""
CAPABILITIES = (
    ("ClientServerSocket", True),
    ("MessageFlags", True),
    ("MetaObjectCache", False),
    ("ObjectPtrUID", True),
    ("RelativeEndpointURI", True),
    ("RemoteCancelableCalls", True),
)
"""Capabilities of qi 3.1.5, in the order in which it sends them."""


class Message(NamedTuple):
    kind: int
    service: int
    object: int
    action: int
    payload: bytes = b""
    identity: int = 1
    flags: int = 0
    version: int = 0

    def pack(self, size: int | None = None) -> bytes:
        """The bytes on the wire; `size` is a lie about the payload."""
        length = len(self.payload) if size is None else size
        head = (MAGIC, self.identity, length, self.version, self.kind, self.flags, self.service, self.object)
        return HEADER.pack(*head, self.action) + self.payload


def text(value: str | bytes) -> bytes:
    data = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(data)) + data


def dynamic(signature: str, value: bytes) -> bytes:
    return text(signature) + value


def flags(*entries: tuple[str, bool]) -> bytes:
    """A map of dynamic booleans."""
    return struct.pack("<I", len(entries)) + b"".join(text(key) + dynamic("b", bytes([on])) for key, on in entries)


LOGIN = Message(CALL, 0, 0, 8, flags(*CAPABILITIES), identity=2)
"""The first message of qi 3.1.5, as recorded."""


def members(described: bytes) -> dict[str, int]:
    """Name -> action of the methods and signals of a metaobject as it is on the wire."""
    place = 0

    def number() -> int:
        nonlocal place
        place += 4
        return int(struct.unpack_from("<I", described, place - 4)[0])

    def word() -> str:
        nonlocal place
        size = number()
        place += size
        return described[place - size : place].decode()

    found = {}
    for _ in range(number()):  # methods
        number()
        action, _result, name, _parameters, _description = number(), word(), word(), word(), word()
        for _ in range(number()):
            word(), word()
        word()
        found[name] = action
    for _ in range(number()):  # signals
        number()
        action, name, _signature = number(), word(), word()
        found[name] = action
    return found


class Closed(ConnectionError):
    """The other end has closed the connection."""


class RawPeer:
    """One end of a connection, message by message.

    Args:
        address: (host, port), or a socket that is connected.
        patience: Seconds that an answer may take.
    """

    def __init__(self, address: tuple[str, int] | socket.socket, patience: float = PATIENCE) -> None:
        self.socket = address if isinstance(address, socket.socket) else socket.create_connection(address, patience)
        self.socket.settimeout(patience)

    def send(self, message: Message | bytes) -> None:
        self.socket.sendall(message.pack() if isinstance(message, Message) else message)

    def receive(self) -> Message:
        """The next message; `Closed` when there is none, TimeoutError when none comes."""
        magic, identity, size, version, kind, flag, service, obj, action = HEADER.unpack(self._exactly(HEADER.size))
        assert magic == MAGIC
        return Message(kind, service, obj, action, self._exactly(size), identity, flag, version)

    def answer(self, message: Message | bytes, *kinds: int) -> Message:
        """Send a message; the next one of these kinds, by default what ends this call, passing over others."""
        self.send(message)
        while True:
            answer = self.next(*kinds)
            if kinds or not isinstance(message, Message) or message.kind != CALL or answer.identity == message.identity:
                return answer

    def next(self, *kinds: int) -> Message:
        while (message := self.receive()).kind not in (kinds or (REPLY, ERROR, CANCELED)):
            pass
        return message

    def log_in(self) -> Message:
        answer = self.answer(LOGIN)
        assert answer.kind == REPLY, answer
        return answer

    def gone(self, patience: float = PATIENCE) -> bool:
        """Whether the other end closes the connection within `patience` seconds; what it says until then is dropped."""
        deadline = time.monotonic() + patience
        try:
            while (left := deadline - time.monotonic()) > 0:
                self.socket.settimeout(left)
                if not self.socket.recv(65536):
                    return True
        except TimeoutError:
            return False
        except OSError:
            return True
        return False

    def reset(self) -> None:
        """Close it with a reset, also while another thread reads from it."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        with contextlib.suppress(OSError):
            self.socket.shutdown(socket.SHUT_RD)
        self.socket.close()

    def close(self) -> None:
        self.socket.close()

    def __enter__(self) -> RawPeer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _exactly(self, size: int) -> bytes:
        parts = []
        while size:
            part = self.socket.recv(min(size, 1 << 20))
            if not part:
                raise Closed("closed by the other end")
            parts.append(part)
            size -= len(part)
        return b"".join(parts)
