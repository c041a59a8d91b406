"""The page's own certificate: browsers give microphone, camera and secret cookies to HTTPS alone.

It is made at the first start, signed by itself, for every name and address of this machine, and made anew when an
address is missing or it is about to end. A site with a domain brings its own.
"""

from __future__ import annotations

import datetime
import ipaddress
import os
import socket
import ssl
from collections.abc import Iterable
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

LIFE = datetime.timedelta(days=397)
"""Browsers of phones take no longer one (Apple: 398 days for those that a person has not installed, 825 else)."""
RENEWED = datetime.timedelta(days=30)
"""It is made anew this long before its end."""


def server_context(folder: Path, addresses: Iterable[str]) -> ssl.SSLContext:
    """Return what a server of these addresses needs; `page.crt` and `page.key` in the folder, made where they lack.

    Raises:
        OSError: The folder cannot be used.
        ssl.SSLError: The two files are no certificate and key.
    """
    certificate, key = folder / "page.crt", folder / "page.key"
    names = {"localhost", socket.gethostname(), *addresses}
    if not _serves(certificate, names):
        _make(certificate, key, names)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.load_cert_chain(certificate, key)
    return context


def fingerprint(folder: Path) -> str:
    """Return the certificate's SHA-256, to be compared with what a browser shows."""
    certificate = x509.load_pem_x509_certificate((folder / "page.crt").read_bytes())
    return ":".join(f"{byte:02X}" for byte in certificate.fingerprint(hashes.SHA256()))


def _serves(file: Path, names: set[str]) -> bool:
    try:
        certificate = x509.load_pem_x509_certificate(file.read_bytes())
        found = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (OSError, ValueError, x509.ExtensionNotFound):
        return False
    held = {str(name.value) for name in found}
    lasts = certificate.not_valid_after_utc - datetime.datetime.now(datetime.UTC)
    return names <= held and lasts > RENEWED


def _make(file: Path, key_file: Path, names: set[str]) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"Pilot's page of {socket.gethostname()}"[:64])])
    now = datetime.datetime.now(datetime.UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))  # a clock may be slow
        .not_valid_after(now + LIFE)
        .add_extension(x509.SubjectAlternativeName([_name(name) for name in sorted(names)]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    encoded = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    descriptor = os.open(key_file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    with os.fdopen(descriptor, "wb") as opened:
        os.fchmod(descriptor, 0o600)
        opened.write(encoded)
    file.write_bytes(certificate.public_bytes(serialization.Encoding.PEM))


def _name(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(name))
    except ValueError:
        return x509.DNSName(name)
