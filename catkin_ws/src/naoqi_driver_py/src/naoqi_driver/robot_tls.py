"""TLS for the drive server where it is far from a robot with NAOqi 2.9: `tcps://ROBOT:9503`.

Wire: TLS 1.2 or later with a certificate that the robot has signed itself. It is compared with the pin of
`certificate_pin` at the end of the handshake, before a byte of ours follows, and the same pin counts for all
connections to the robot. Then the login: `auth_user`, `auth_token` (aldebaran/libqi-python, issues 7 and 22).

One thread of the drive server sends while another receives, and OpenSSL's objects take one thread at a time. So they
see no socket, only memory, under the connection's lock; see `telepresence.robot_side.naoqi_connection`. Python 3 only:
nothing on the robot imports this.
"""

from __future__ import annotations

import os
import socket
import ssl
import time
from collections.abc import Callable

from naoqi_driver.certificate_pin import CertificatePin, tls_context
from telepresence.robot_side.naoqi_values import NaoqiError

USER, PASSWORD = "NAO_USER", "NAO_PASSWORD"
"""Variables of the environment."""
DEFAULT_USER = "nao"
_PIECE = 65536


class RobotTls:
    """What all connections to one robot have in common.

    Args:
        pin: Knows its certificate.
        user, password: For its login; without both nothing is said there.
    Attributes:
        login: What is said at the login.
        login_from: Where that is from, for people.
    Raises:
        ValueError: User or password is no text.
    """

    def __init__(self, pin: CertificatePin, user: str | None = None, password: str | None = None) -> None:
        self._context = tls_context(pin)
        self._context.options |= ssl.OP_NO_RENEGOTIATION  # in one, sending would have to wait for the robot
        self.login: dict[str, str] = {}
        self.login_from = f"{USER} and {PASSWORD} are not set"
        if user or password:
            self.login = {"auth_user": user or DEFAULT_USER, "auth_token": password or ""}
            self.login_from = f"user and password are those of {USER} and {PASSWORD}"
        for name, value in ((USER, user), (PASSWORD, password)):
            try:
                (value or "").encode()
            except UnicodeEncodeError:
                raise ValueError(f"{name} is not UTF-8") from None

    @classmethod
    def from_environment(cls, place: tuple[str, int], report: Callable[[str], object]) -> RobotTls:
        """Return that for the robot at host and port. `report` takes the line about a certificate that is new."""
        return cls(CertificatePin(*place, report), os.environ.get(USER), os.environ.get(PASSWORD))

    def begin(self, stream: socket.socket, host: str, timeout: float) -> Cipher:
        """Do the handshake on a socket that is connected, within `timeout` seconds.

        Raises:
            CertificateRefused: The robot's certificate is not the one that is trusted.
            NaoqiError, OSError: There is no TLS.
        """
        deadline = time.monotonic() + timeout
        received, to_send = ssl.MemoryBIO(), ssl.MemoryBIO()
        tls = self._context.wrap_bio(received, to_send, server_hostname=host)
        done = False
        while True:
            try:
                tls.do_handshake()
                done = True
            except ssl.SSLWantReadError:
                pass
            except ssl.SSLError as error:
                raise NaoqiError(f"it speaks no TLS that can be used: {_words(error)}") from None
            try:
                stream.settimeout(max(0.001, deadline - time.monotonic()))
                stream.sendall(to_send.read())
                if done:
                    return Cipher(tls, received, to_send)
                data = stream.recv(_PIECE)
            except TimeoutError:
                raise NaoqiError(f"it did not answer by TLS within {timeout:g} s") from None
            if not data:
                raise NaoqiError("it closed the connection instead of answering by TLS")
            received.write(data)


class Cipher:
    """One connection after its handshake. One thread at a time may use it.

    Args:
        received, to_send: What `tls` reads from and writes to.
    """

    def __init__(self, tls: ssl.SSLObject, received: ssl.MemoryBIO, to_send: ssl.MemoryBIO) -> None:
        self._tls, self._received, self._to_send = tls, received, to_send

    def seal(self, data: bytes) -> bytes:
        """Return what has to be sent for some bytes.

        Raises:
            NaoqiError: The robot has ended the connection.
        """
        left = memoryview(data)
        try:
            while left:
                left = left[self._tls.write(left) :]
        except ssl.SSLError as error:
            raise NaoqiError(f"TLS: {_words(error)}") from None
        return self._to_send.read()

    def open(self, data: bytes) -> tuple[bytes, bytes]:
        """Return the bytes in what came, and what has to be sent because of it.

        Raises:
            NaoqiError: Somebody has changed what came, or the robot has ended the connection.
        """
        self._received.write(data)
        plain = bytearray()
        try:
            while piece := self._tls.read(_PIECE):  # nothing: the robot sends no more, as the socket will say
                plain += piece
        except (ssl.SSLWantReadError, ssl.SSLZeroReturnError):
            pass
        except ssl.SSLError as error:
            raise NaoqiError(f"TLS: {_words(error)}") from None
        return bytes(plain), self._to_send.read()


def _words(error: ssl.SSLError) -> str:
    """What OpenSSL says, without the line of its source."""
    return (error.reason or str(error)).replace("_", " ").lower()
