"""The proxy's certificate and configuration, before it starts."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from telepresence.page import certificate
from telepresence.site import __main__, proxy
from telepresence.site.caddyfile import Files
from telepresence.site.site_file import SiteError, parse_site
from telepresence.station.station_folder import StationFolder


def test_a_certificate_that_is_none_is_named(tmp_path):
    (tmp_path / "own.crt").write_text("x")
    site = parse_site("certificate = 'own.crt'\n[robot.anna]", tmp_path)
    with pytest.raises(SiteError, match=r"own\.crt .* are no certificate and key"):
        proxy.certificate_files(site, tmp_path)


def test_another_sites_certificate_leaves_that_of_a_running_one_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    here = proxy.certificate_files(parse_site("[robot.anna]", tmp_path), tmp_path)
    before = here.certificate.read_bytes(), here.key.read_bytes()
    long_name = f"{'a' * 60}.{'b' * 60}.{'c' * 60}.{'d' * 60}"
    for other in ("address = '10.0.0.5'", "name = 'robots.example'", f"name = '{long_name}'"):
        assert proxy.certificate_files(parse_site(f"{other}\n[robot.anna]", tmp_path), tmp_path) != here
    assert (here.certificate.read_bytes(), here.key.read_bytes()) == before
    assert proxy.certificate_files(parse_site("port = 9000\n[robot.ben]", tmp_path), tmp_path) == here


def test_a_certificate_of_our_own_is_renewed_in_time_though_the_site_runs_on(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    site = parse_site("[robot.anna]", tmp_path)
    files = proxy.certificate_files(site, tmp_path)
    watch = proxy.CertificateWatch(site, files, now=0.0)
    before = files.certificate.read_bytes()
    monkeypatch.setattr(certificate, "RENEWED", certificate.LIFE)  # it is about to end
    looks = (0.9 * proxy.LOOK_PERIOD, 1.1 * proxy.LOOK_PERIOD, 1.1 * proxy.RENEW_PERIOD)
    assert [watch.renewed(now) for now in looks] == [False, False, True]
    assert files.certificate.read_bytes() != before


def test_a_certificate_that_was_only_copied_is_not_renewed(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    site = parse_site("[robot.anna]", tmp_path)
    files = proxy.certificate_files(site, tmp_path)
    watch = proxy.CertificateWatch(site, files, now=0.0)
    os.utime(files.certificate, (0, 0))
    assert not watch.renewed(1.1 * proxy.LOOK_PERIOD)
    copy = tmp_path / "copy"
    copy.write_bytes(files.key.read_bytes())
    copy.replace(files.key)
    assert not watch.renewed(2.2 * proxy.LOOK_PERIOD)
    files.certificate.unlink()
    proxy.certificate_files(site, tmp_path)
    assert watch.renewed(3.3 * proxy.LOOK_PERIOD)


@pytest.fixture
def instead_of_caddy(tmp_path, monkeypatch) -> Callable[[str], None]:
    """Put a shell script in Caddy's place."""

    def put(script: str) -> None:
        file = tmp_path / "caddy"
        file.write_text(f"#!/bin/sh\n{script}\n")
        file.chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")

    return put


@pytest.mark.parametrize(
    ("script", "says"),
    [
        ("kill -INT $$", "caddy refuses the site: it ended without a word"),
        ("echo; echo Error: no such directive >&2; exit 1", "caddy refuses the site: Error: no such directive"),
        ("exec sleep 1000", "caddy does not say within 0.2 s whether it takes the site"),
    ],
)
def test_a_caddy_that_does_not_take_the_site_is_one_sentence(tmp_path, monkeypatch, instead_of_caddy, script, says):
    monkeypatch.setattr(proxy, "JUDGING", 0.2)
    instead_of_caddy(script)
    with pytest.raises(SiteError) as caught:
        proxy.write_caddyfile(parse_site("[robot.anna]", tmp_path), Files(Path("a.crt"), Path("a.key"), tmp_path))
    assert str(caught.value) == says


def test_a_check_that_is_interrupted_ends_without_a_traceback(tmp_path, monkeypatch):
    def interrupted(site, folder):
        raise KeyboardInterrupt

    file = tmp_path / "site.toml"
    file.write_text("[robot.anna]\n")
    monkeypatch.setattr(__main__, "require_ports", lambda site: None)
    monkeypatch.setattr(__main__, "certificate_files", interrupted)
    assert __main__.main(["check", str(file)]) == 130


def test_a_check_has_as_long_a_path_as_the_site(tmp_path, monkeypatch):
    """Or it refuses a folder for temporary files in which the site's sockets have room."""

    def judged(site, folder):
        raise SiteError(str(folder))

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(__main__, "require_ports", lambda site: None)
    monkeypatch.setattr(__main__, "certificate_files", judged)
    with pytest.raises(SiteError) as caught:
        __main__.check(parse_site("[robot.anna]", tmp_path))
    folder = StationFolder()
    folder.close()
    assert len(str(caught.value)) == len(str(folder.path))
