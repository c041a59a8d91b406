"""The certificate of a robot that speaks TLS: trusted at the first connection, compared at every later one.

A robot signs its certificate itself, so nobody vouches for it. Its SHA-256 fingerprint is kept in the pilot's store,
`$XDG_CONFIG_HOME/telepresence/certificates/HOST_PORT.sha256`, which only its owner can read and write. Whoever stands
between pilot and robot at the very first connection is not noticed by this: compare the fingerprint that is shown then.
"""

from __future__ import annotations

import contextlib
import hashlib
import ipaddress
import logging
import os
import re
import ssl
import stat
from collections.abc import Callable
from pathlib import Path

log = logging.getLogger(__name__)

_FINGERPRINT = re.compile(r"(?:[0-9A-F]{2}:){31}[0-9A-F]{2}")


class CertificateRefused(OSError):
    """The certificate is not the one that was trusted, or it cannot be known; the text has the remedy."""


class CertificatePin:
    """The certificate of the robot at one address.

    Args:
        host, port: Of the robot, as the pilot types them.
        report: Takes the line about a certificate that is trusted from now on.
    """

    def __init__(self, host: str, port: int, report: Callable[[str], object] = log.warning) -> None:
        self._robot, self._report = f"{host}:{port}", report
        self.path = path_of(host, port)

    def check(self, certificate: bytes) -> None:
        """Compare a certificate with the trusted one; trust it if there is none.

        Args:
            certificate: As the robot showed it (DER).
        Raises:
            CertificateRefused: It is another one, or the store cannot be used.
        """
        if not certificate:
            raise CertificateRefused(f"{self._robot} shows no certificate")
        shown = fingerprint(certificate)
        try:
            trusted = self._read()
            if trusted is None:
                trusted = self._write(shown)
        except CertificateRefused:
            raise
        except OSError as error:
            raise CertificateRefused(f"the robot's certificate cannot be kept at {self.path}: {error}") from None
        if shown != trusted:
            raise CertificateRefused(
                f"the certificate of {self._robot} has changed: somebody may stand in between, so no password is sent. "
                f"Only if you know why (a robot set up anew):  rm {self.path}"
            )

    def _read(self) -> str | None:
        try:
            file = os.open(self.path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        except FileNotFoundError:
            return None
        with open(file, "rb") as opened:
            status = os.fstat(file)
            if not stat.S_ISREG(status.st_mode) or status.st_uid != os.geteuid() or status.st_mode & 0o077:
                raise CertificateRefused(f"others can change {self.path}: it must be a file of yours with mode 0600")
            text = opened.read(200).decode("ascii", "replace").strip()
        if not _FINGERPRINT.fullmatch(text):
            raise CertificateRefused(f"{self.path} holds no fingerprint:  rm {self.path}")
        return text

    def _write(self, shown: str) -> str:
        """Keep the fingerprint, unless another program was quicker; return the one that is kept."""
        folder = self.path.parent
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder.chmod(0o700)
        # Programs start together: the file appears whole, and only the first one's.
        new = folder / f".{self.path.name}.{os.getpid()}"
        new.unlink(missing_ok=True)
        with open(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600), "w") as file:
            file.write(f"{shown}\n")
        try:
            os.link(new, self.path)
            self._report(
                f"first connection to the robot at {self._robot}: its certificate {shown} is trusted from now on"
            )
        except FileExistsError:
            return self._read() or shown
        finally:
            new.unlink()
        return shown


def tls_context(pin: CertificatePin) -> ssl.SSLContext:
    """Return the TLS that a client of the robot uses, for all of its connections.

    A handshake ends with the check of the certificate, or with `CertificateRefused`: what is checked is what is used,
    and nothing is sent to, or read from, somebody else.
    """

    class Checked(ssl.SSLSocket):
        def do_handshake(self, block: bool = False) -> None:
            super().do_handshake(block)
            pin.check(self.getpeercert(binary_form=True) or b"")

    class CheckedObject(ssl.SSLObject):  # of `wrap_bio`
        def do_handshake(self) -> None:
            super().do_handshake()
            pin.check(self.getpeercert(binary_form=True) or b"")

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    # A robot signs its certificate itself: there is no authority to ask. The pin says whose it is.
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    context.sslsocket_class, context.sslobject_class = Checked, CheckedObject
    return context


def fingerprint(certificate: bytes) -> str:
    """Return the SHA-256 of a certificate (DER) as browsers and openssl write it."""
    return hashlib.sha256(certificate).digest().hex(":").upper()


def path_of(host: str, port: int) -> Path:
    """Return the file for a robot, whether or not it exists."""
    with contextlib.suppress(ValueError):
        host = str(ipaddress.ip_address(host.strip("[]")))
    name = re.sub(r"[^a-z0-9._-]", "_", host.lower())[:200]
    base = Path(os.environ.get("XDG_CONFIG_HOME") or "~/.config").expanduser()
    return base / "telepresence" / "certificates" / f"{name}_{port}.sha256"
