"""The page's own certificate: for the names that browsers use, signed by an authority that phones can install."""

import datetime
import socket
import ssl
import sys
import threading

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from telepresence_ros.pseudo_terminal import Terminal

from telepresence.page import certificate
from telepresence.page.certificate import fingerprint, names_of, own_context, server_context, server_files

READS = """
import sys
from pathlib import Path
from telepresence.page.certificate import own_context
try:
    own_context(*map(Path, sys.argv[1:]))
except OSError as error:
    print("refused:", error)
"""


def names(folder):
    read = x509.load_pem_x509_certificate((folder / "page.crt").read_bytes())
    return {str(name.value) for name in read.extensions.get_extension_for_class(x509.SubjectAlternativeName).value}


def test_it_is_made_once_for_localhost_and_the_addresses(tmp_path):
    folder = tmp_path / "page"
    context = server_context(folder, ["127.0.0.1", "192.0.2.7"])
    assert isinstance(context, ssl.SSLContext) and {"localhost", "127.0.0.1", "192.0.2.7"} <= names(folder)
    assert (folder / "page.key").stat().st_mode & 0o777 == 0o600
    before = fingerprint(folder / "page.crt")
    server_context(folder, ["127.0.0.1"])
    assert fingerprint(folder / "page.crt") == before and len(before) == 95


def test_it_is_made_anew_for_another_address_and_before_its_end(tmp_path, monkeypatch):
    server_context(tmp_path, ["127.0.0.1"])
    first = fingerprint(tmp_path / "page.crt")
    server_context(tmp_path, ["192.0.2.8"])
    second = fingerprint(tmp_path / "page.crt")
    assert first != second
    monkeypatch.setattr(certificate, "RENEWED", certificate.LIFE + datetime.timedelta(days=1))
    server_context(tmp_path, ["192.0.2.8"])
    assert fingerprint(tmp_path / "page.crt") != second


def test_what_is_no_certificate_is_replaced(tmp_path):
    (tmp_path / "page.crt").write_text("nothing")
    server_context(tmp_path, ["127.0.0.1"])
    assert "127.0.0.1" in names(tmp_path)


def answers(context, trusted, name):
    """Whether a browser that trusts this file takes the certificate of a server for that name."""
    ours, theirs = socket.socketpair()
    server = threading.Thread(target=shake_hands, args=(context, theirs))
    server.start()
    try:
        with ssl.create_default_context(cafile=trusted).wrap_socket(ours, server_hostname=name):
            return True
    except ssl.SSLCertVerificationError:
        return False
    finally:
        ours.close()
        server.join()


def shake_hands(context, connection):
    try:
        context.wrap_socket(connection, server_side=True).close()
    except ssl.SSLError:
        connection.close()  # the browser has refused


def test_who_trusts_the_authority_is_not_warned_and_it_signs_for_private_networks_alone(tmp_path):
    context = server_context(tmp_path, ["127.0.0.1", "192.168.1.5", "93.184.216.34"])
    trusted = tmp_path / "authority.crt"
    assert not answers(context, None, "127.0.0.1"), "the authority is not known to anybody"
    assert not answers(context, trusted, "192.168.1.5"), "an address of somebody else is among them"
    context = server_context(tmp_path / "page", ["127.0.0.1", "192.168.1.5"])
    trusted = tmp_path / "page" / "authority.crt"
    assert all(answers(context, trusted, name) for name in ("127.0.0.1", "192.168.1.5", "localhost"))
    assert not answers(context, trusted, "192.168.1.6")
    assert (tmp_path / "page" / "authority.key").stat().st_mode & 0o777 == 0o600


def test_the_authority_stays_when_the_certificate_is_made_anew(tmp_path):
    server_context(tmp_path, ["127.0.0.1"])
    before = fingerprint(tmp_path / "authority.crt")
    server_context(tmp_path, ["10.0.0.7"])
    assert fingerprint(tmp_path / "authority.crt") == before
    (tmp_path / "authority.key").unlink()
    context = server_context(tmp_path, ["10.0.0.7"])
    assert fingerprint(tmp_path / "authority.crt") != before
    assert answers(context, tmp_path / "authority.crt", "10.0.0.7"), "signed anew, too"


def test_a_person_brings_a_certificate(tmp_path):
    server_context(tmp_path, ["127.0.0.1"])
    one = tmp_path / "one.pem"
    one.write_bytes((tmp_path / "page.crt").read_bytes() + (tmp_path / "page.key").read_bytes())
    assert answers(own_context(one), tmp_path / "authority.crt", "127.0.0.1")
    assert answers(own_context(tmp_path / "page.crt", tmp_path / "page.key"), tmp_path / "authority.crt", "localhost")
    assert set(names_of(one)) == {"localhost", socket.gethostname()}
    with pytest.raises(ssl.SSLError):
        own_context(tmp_path / "page.crt")


def test_a_key_with_a_passphrase_is_refused_and_nobody_is_asked(tmp_path, wait_until):
    """OpenSSL asks at the controlling terminal, and a supervisor that waits there brings nobody back."""
    made, key_file = server_files(tmp_path, ["127.0.0.1"])
    key = serialization.load_pem_private_key(key_file.read_bytes(), None)
    secret = serialization.BestAvailableEncryption(b"secret")
    key_file.write_bytes(key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, secret))
    terminal = Terminal(sys.executable, "-c", READS, str(made), str(key_file))
    try:
        wait_until(lambda: "\n" in terminal.seen or "pass phrase" in terminal.seen, "it has read the key")
        assert "refused: the key has a passphrase" in terminal.seen
    finally:
        terminal.close()
