"""The page's certificate: browsers give microphone, camera and secret cookies to HTTPS alone.

A site with a domain brings its own. Otherwise this computer is an authority of its own, made at the first start: who
installs `authority.crt` on a phone, once, is not warned any more. It can sign for this computer's name and for
addresses of private networks alone, so that whoever steals its key cannot pose as anybody else to that phone. The
certificate that it has signed is for every name and address of this machine, and made anew when an address is missing
or it is about to end.
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
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

LIFE = datetime.timedelta(days=397)
"""Browsers of phones take no longer one (Apple: 398 days for those that a person has not installed, 825 else)."""
RENEWED = datetime.timedelta(days=30)
"""It is made anew this long before its end."""
AUTHORITY_LIFE = datetime.timedelta(days=3650)
PRIVATE = (
    "127.0.0.0/8", "10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "169.254.0.0/16", "100.64.0.0/10",
    "::1/128", "fc00::/7", "fe80::/10",
)  # fmt: skip
"""Networks for which the authority can sign: RFC 1918, 3927, 6598 (Tailscale), 4193, 4291."""
_SLOW_CLOCK = datetime.timedelta(days=1)


def own_context(certificate: Path, key: Path | None = None) -> ssl.SSLContext:
    """Return what a server with a certificate of a person's own needs: PEM, with its chain; `key` where it is apart.

    Raises:
        OSError, ssl.SSLError: The files cannot be read, are no certificate and key, or the key has a passphrase.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.load_cert_chain(certificate, key, _no_passphrase)  # OpenSSL itself would ask at the terminal, and wait
    return context


def _no_passphrase() -> str:
    """Stand in for the person who would type a passphrase."""
    raise OSError("the key has a passphrase; a server needs one without (openssl pkey -in KEY -out OTHER)")


def server_context(folder: Path, addresses: Iterable[str]) -> ssl.SSLContext:
    """Return what a server of these addresses needs. See `server_files`.

    Raises:
        OSError: The folder cannot be used.
        ssl.SSLError: The two files are no certificate and key.
    """
    return own_context(*server_files(folder, addresses))


def server_files(folder: Path, addresses: Iterable[str], name: str = "page") -> tuple[Path, Path]:
    """Return the files of a certificate for these addresses, NAME.crt, and of its key, NAME.key, in the folder; made
    where they lack, as is the authority that signs them.

    Raises:
        OSError: The folder cannot be used.
    """
    certificate, key = folder / f"{name}.crt", folder / f"{name}.key"
    names = {"localhost", socket.gethostname(), *addresses}
    authority, authority_key = _authority(folder)
    if not _serves(certificate, names, authority):
        _make(certificate, key, names, authority, authority_key)
    return certificate, key


def names_of(certificate: Path) -> list[str]:
    """Return the host names that a certificate is for, without those with an asterisk. Raises OSError, ValueError."""
    read = x509.load_pem_x509_certificate(certificate.read_bytes())
    try:
        found = read.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [name for name in found.get_values_for_type(x509.DNSName) if "*" not in name]


def fingerprint(file: Path) -> str:
    """Return a certificate's SHA-256, to be compared with what a browser shows."""
    certificate = x509.load_pem_x509_certificate(file.read_bytes())
    return ":".join(f"{byte:02X}" for byte in certificate.fingerprint(hashes.SHA256()))


def _authority(folder: Path) -> tuple[x509.Certificate, ec.EllipticCurvePrivateKey]:
    """Return this computer's authority, made where it lacks or is about to end."""
    file, key_file = folder / "authority.crt", folder / "authority.key"
    try:
        certificate = x509.load_pem_x509_certificate(file.read_bytes())
        key = serialization.load_pem_private_key(key_file.read_bytes(), None)
        if isinstance(key, ec.EllipticCurvePrivateKey) and certificate.public_key() == key.public_key():
            if certificate.not_valid_after_utc - datetime.datetime.now(datetime.UTC) > LIFE:
                return certificate, key
    except (OSError, ValueError):
        pass  # there is none yet, or what is there is none
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"Robots of {socket.gethostname()}"[:64])])
    own_names = [x509.DNSName(name) for name in dict.fromkeys(("localhost", socket.gethostname()))]
    networks = [x509.IPAddress(ipaddress.ip_network(network)) for network in PRIVATE]
    sign_only = dict.fromkeys(
        ("digital_signature", "content_commitment", "key_encipherment", "data_encipherment", "key_agreement",
         "crl_sign", "encipher_only", "decipher_only"), False
    )  # fmt: skip
    builder = (
        _builder(name, name, key, AUTHORITY_LIFE)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(x509.KeyUsage(key_cert_sign=True, **sign_only), critical=True)
        .add_extension(x509.NameConstraints([*own_names, *networks], None), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    )
    certificate = builder.sign(key, hashes.SHA256())
    _write(file, key_file, certificate, key)
    return certificate, key


def _serves(file: Path, names: set[str], authority: x509.Certificate) -> bool:
    try:
        certificate = x509.load_pem_x509_certificate(file.read_bytes())
        found = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        certificate.verify_directly_issued_by(authority)
    except (OSError, ValueError, TypeError, InvalidSignature, x509.ExtensionNotFound):
        return False
    held = {str(name.value) for name in found}
    lasts = certificate.not_valid_after_utc - datetime.datetime.now(datetime.UTC)
    return names <= held and lasts > RENEWED


def _make(
    file: Path, key_file: Path, names: set[str], authority: x509.Certificate, signs: ec.EllipticCurvePrivateKey
) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"Pilot's page of {socket.gethostname()}"[:64])])
    certificate = (
        _builder(subject, authority.subject, key, LIFE)
        .add_extension(x509.SubjectAlternativeName([_name(name) for name in sorted(names)]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(signs.public_key()), critical=False)
        .sign(signs, hashes.SHA256())
    )
    _write(file, key_file, certificate, key)


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, life: datetime.timedelta
) -> x509.CertificateBuilder:
    now = datetime.datetime.now(datetime.UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _SLOW_CLOCK)
        .not_valid_after(now + life)
    )


def _write(file: Path, key_file: Path, certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> None:
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
