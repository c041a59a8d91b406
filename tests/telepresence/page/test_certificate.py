"""The page's own certificate: for the names that browsers use, and only readable for its owner."""

import datetime
import ssl

from cryptography import x509

from telepresence.page import certificate
from telepresence.page.certificate import fingerprint, server_context


def names(folder):
    read = x509.load_pem_x509_certificate((folder / "page.crt").read_bytes())
    return {str(name.value) for name in read.extensions.get_extension_for_class(x509.SubjectAlternativeName).value}


def test_it_is_made_once_for_localhost_and_the_addresses(tmp_path):
    folder = tmp_path / "page"
    context = server_context(folder, ["127.0.0.1", "192.0.2.7"])
    assert isinstance(context, ssl.SSLContext) and {"localhost", "127.0.0.1", "192.0.2.7"} <= names(folder)
    assert (folder / "page.key").stat().st_mode & 0o777 == 0o600
    before = fingerprint(folder)
    server_context(folder, ["127.0.0.1"])
    assert fingerprint(folder) == before and len(before) == 95


def test_it_is_made_anew_for_another_address_and_before_its_end(tmp_path, monkeypatch):
    server_context(tmp_path, ["127.0.0.1"])
    first = fingerprint(tmp_path)
    server_context(tmp_path, ["192.0.2.8"])
    second = fingerprint(tmp_path)
    assert first != second
    monkeypatch.setattr(certificate, "RENEWED", certificate.LIFE + datetime.timedelta(days=1))
    server_context(tmp_path, ["192.0.2.8"])
    assert fingerprint(tmp_path) != second


def test_what_is_no_certificate_is_replaced(tmp_path):
    (tmp_path / "page.crt").write_text("nothing")
    server_context(tmp_path, ["127.0.0.1"])
    assert "127.0.0.1" in names(tmp_path)
