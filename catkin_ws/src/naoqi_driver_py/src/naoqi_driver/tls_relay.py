"""The way to a robot that speaks TLS (`tcps`, NAOqi 2.9), with a certificate that is checked.

libqi encrypts but checks no certificate, neither on the first connection nor on those that it opens to the addresses
that a robot's directory names: it gives the robot's password to whoever answers. So libqi gets no TLS to do. It speaks
to this relay on loopback; the relay opens a TLS connection of its own, compares the certificate with the one that was
pinned (`certificate_pin`), and only then passes bytes on. What is checked is what is used. And so that libqi never
leaves the relay, the addresses in the directory's answers are replaced by one that means the connection it has.

Other users of this computer can connect to the relay's port too. They get what they would get from the robot: a
question for the password, which the relay does not know.

Wire: `ServiceDirectory` is service 1, object 1; actions 100 `service` and 101 `services` answer with
(name s, serviceId I, machineId s, processId I, endpoints [s], sessionId s[, objectUid s]), little-endian, a text or a
list after its length in four bytes. A message has a head of 28 bytes: magic, id, size, version (2), type (1),
flags (1), service, object, action. Source: libqi, src/messaging/message.hpp, src/registration.cpp.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import ssl
import struct
import threading

from naoqi_driver.certificate_pin import CertificatePin, CertificateRefused

log = logging.getLogger(__name__)

HANDSHAKE_TIMEOUT = 1.8
"""Seconds allowed for a connection to the robot and its handshake."""
MOST_CONNECTIONS = 8
"""libqi needs one; what other programs open ends when they say nothing that the robot likes."""
LARGEST_LIST = 4 * 1024 * 1024
"""Bytes of a list of services."""
PIECE = 256 * 1024
_HEAD = struct.Struct("<IIIHBBIII")
_MAGIC, _REPLY, _DYNAMIC = 0x42ADDE42, 2, 1
_SERVICE, _SERVICES = 100, 101
_HERE = b"qi:ServiceDirectory"
"""Address by which libqi means the connection that it has."""


class TlsRelay:
    """Listens on loopback from the beginning to `close`, so that nobody else can have its port meanwhile.

    Args:
        host, port: Of the robot.
        pin: Its certificate.
    Raises:
        OSError: Nothing can listen on loopback.
    """

    def __init__(self, host: str, port: int, pin: CertificatePin) -> None:
        self.problem = ""
        """Why the last connection to the robot failed; empty when it did not."""
        self._host, self._port, self._pin = host, port, pin
        self._context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        # A robot signs its certificate itself: there is no authority to ask. The pin says whose it is.
        self._context.check_hostname = False
        self._context.verify_mode = ssl.CERT_NONE
        self._connections: set[asyncio.Task[None]] = set()
        self._loop = asyncio.new_event_loop()
        self._server = self._loop.run_until_complete(
            asyncio.start_server(self._serve, "127.0.0.1", 0, limit=PIECE, start_serving=False)
        )
        self.url = f"tcp://127.0.0.1:{self._server.sockets[0].getsockname()[1]}"
        """Where libqi finds the robot."""
        self._thread = threading.Thread(target=self._run, name="tls-relay", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._server.start_serving())
        self._loop.run_forever()
        self._server.close()
        for task in asyncio.all_tasks(self._loop):
            task.cancel()
        self._loop.run_until_complete(asyncio.sleep(0))
        self._loop.close()

    async def _serve(self, near: asyncio.StreamReader, to_near: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        if task is None or len(self._connections) >= MOST_CONNECTIONS:
            to_near.close()
            return
        self._connections.add(task)
        to_far: asyncio.StreamWriter | None = None
        try:
            async with asyncio.timeout(HANDSHAKE_TIMEOUT):
                far, to_far = await asyncio.open_connection(
                    self._host, self._port, ssl=self._context, limit=PIECE, server_hostname=self._host
                )
            certificate = to_far.get_extra_info("ssl_object").getpeercert(binary_form=True)
            self._pin.check(certificate or b"")
            self.problem = ""
            ways = [asyncio.ensure_future(_copy(near, to_far)), asyncio.ensure_future(self._copy_back(far, to_near))]
            try:
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)
        except CertificateRefused as error:
            self.problem = str(error)
        except ssl.SSLError as error:
            self.problem = f"no TLS: {error.reason or 'it ends the handshake'}"
        except (OSError, TimeoutError) as error:
            self.problem = getattr(error, "strerror", None) or f"no answer within {HANDSHAKE_TIMEOUT:g} s"
        finally:
            self._connections.discard(task)
            for writer in (to_near, to_far):
                if writer is not None:
                    writer.transport.abort()

    async def _copy_back(self, far: asyncio.StreamReader, to_near: asyncio.StreamWriter) -> None:
        """Messages of the robot, until it hangs up or sends what is none."""
        with contextlib.suppress(OSError, asyncio.IncompleteReadError, NotAMessage):
            while True:
                head = await far.readexactly(_HEAD.size)
                magic, number, size, version, kind, flags, service, object_, action = _HEAD.unpack(head)
                if magic != _MAGIC:
                    raise NotAMessage
                if kind == _REPLY and (service, object_) == (1, 1) and action in (_SERVICE, _SERVICES):
                    if size > LARGEST_LIST or flags & _DYNAMIC:
                        raise NotAMessage
                    payload = without_addresses(await far.readexactly(size), action == _SERVICES)
                    head = _HEAD.pack(magic, number, len(payload), version, kind, flags, service, object_, action)
                    to_near.write(head + payload)
                else:
                    to_near.write(head)
                    while size:
                        piece = await far.readexactly(min(size, PIECE))
                        size -= len(piece)
                        to_near.write(piece)
                        await to_near.drain()
                await to_near.drain()


class NotAMessage(ValueError):
    """The robot sent what is no message of NAOqi; the connection ends."""


async def _copy(near: asyncio.StreamReader, to_far: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await near.read(PIECE):
            to_far.write(data)
            await to_far.drain()


def without_addresses(payload: bytes, several: bool) -> bytes:
    """Return what the directory answered, with every service where the directory is: on the connection that asked.

    Args:
        payload: One ServiceInfo, or a list of them if `several`.
    Raises:
        NotAMessage: It is none.
    """
    for texts_behind in (2, 1):  # directories before 2020 do not name the object's id
        with contextlib.suppress(NotAMessage):
            return _replace(_Reader(payload), several, texts_behind)
    raise NotAMessage


def _replace(reader: _Reader, several: bool, texts_behind: int) -> bytes:
    made = [struct.pack("<I", reader.number())] if several else [b""]
    for _ in range(int.from_bytes(made[0], "little") if several else 1):
        begin = reader.at
        reader.text()  # name
        reader.number()
        reader.text()  # machine
        reader.number()
        made.append(reader.since(begin))
        for _ in range(reader.number()):
            reader.text()
        made.append(struct.pack("<II", 1, len(_HERE)) + _HERE)
        begin = reader.at
        for _ in range(texts_behind):  # session and object
            reader.text()
        made.append(reader.since(begin))
    if not reader.at_end:
        raise NotAMessage
    return b"".join(made)


class _Reader:
    def __init__(self, data: bytes) -> None:
        self._data = data
        self.at = 0

    @property
    def at_end(self) -> bool:
        return self.at == len(self._data)

    def since(self, begin: int) -> bytes:
        return self._data[begin : self.at]

    def number(self) -> int:
        if self.at + 4 > len(self._data):
            raise NotAMessage
        self.at += 4
        return int.from_bytes(self._data[self.at - 4 : self.at], "little")

    def text(self) -> None:
        size = self.number()
        if self.at + size > len(self._data):
            raise NotAMessage
        self.at += size
