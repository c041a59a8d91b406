"""A TLS server in front of a NAOqi, as on robots with NAOqi 2.9; its certificate can be exchanged."""

from __future__ import annotations

import contextlib
import datetime
import socket
import ssl
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import NameOID
from tcp_listener import TcpListener


def make_certificate(folder: Path, name: str) -> Path:
    """Write a self-signed certificate and its key into one new file."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    now = datetime.datetime.now(datetime.UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .sign(key, hashes.SHA256())
    )
    path = folder / f"{name}.pem"
    private = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.TraditionalOpenSSL, serialization.NoEncryption()
    )
    path.write_bytes(certificate.public_bytes(serialization.Encoding.PEM) + private)
    return path


class TlsFront:
    """Passes on to a NAOqi at `target` what comes over TLS; keeps what clients sent, decrypted.

    Args:
        target: Port of a NAOqi on loopback without TLS.
        certificate: File with certificate and key; None: no TLS at all.
        place: Address and port where it listens; 0 takes a free one.
    """

    def __init__(self, target: int, certificate: Path | None, place: tuple[str, int] = ("127.0.0.1", 0)) -> None:
        self.received = b""
        self.connections = 0
        self._target = target
        self._sockets: list[socket.socket] = []
        self.show(certificate)
        self._listener = TcpListener(self._talk, place)
        self.port = self._listener.port

    def show(self, certificate: Path | None) -> None:
        """Show this certificate from the next connection on, and cut those that there are."""
        self._context = None
        if certificate is not None:
            self._context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            self._context.load_cert_chain(certificate)
        self.cut()

    def cut(self) -> None:
        for end in self._sockets:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._sockets = []

    def close(self) -> None:
        self._listener.close()
        self.cut()

    def _talk(self, near: socket.socket) -> None:
        """One thread for both ways: a TLS socket does not belong to two."""
        with contextlib.suppress(OSError), near, socket.create_connection(("127.0.0.1", self._target)) as far:
            near.settimeout(10.0)
            if self._context is not None:
                near = self._context.wrap_socket(near, server_side=True)
            self.connections += 1
            self._sockets += [near, far]
            near.settimeout(0.005)
            far.settimeout(0.005)
            with near:
                while True:
                    with contextlib.suppress(TimeoutError):
                        data = near.recv(65536)
                        if not data:
                            return
                        self.received += data
                        far.sendall(data)
                    with contextlib.suppress(TimeoutError):
                        if not (data := far.recv(65536)):
                            return
                        near.settimeout(10.0)
                        near.sendall(data)
                        near.settimeout(0.005)
