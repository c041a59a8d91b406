"""The way to a robot that speaks TLS: libqi's own server behind a TLS socket, and whoever takes its place."""

from __future__ import annotations

import os
import stat

import pytest
import qi
from naoqi_driver.certificate_pin import CertificatePin, CertificateRefused, path_of
from naoqi_driver.connection import Address, Connection, RobotError
from tls_front import TlsFront, make_certificate

SECRET = "correct horse"


class Motion:
    def move(self, x: float, y: float, theta: float) -> float:
        return x + y + theta


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    folder = tmp_path_factory.mktemp("certificates")
    return make_certificate(folder, "pepper"), make_certificate(folder, "mallory")


@pytest.fixture
def front(naoqi, certificates, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    naoqi.register("ALMotion", Motion())
    front = TlsFront(naoqi.port, certificates[0])
    yield front
    front.close()


def connect(front: TlsFront, scheme: str = "tcps") -> Connection:
    return Connection(Address.parse(f"{scheme}://127.0.0.1", front.port, "nao", SECRET))


def test_the_password_goes_to_the_robot_whose_certificate_is_known(front, wait_until, caplog):
    with connect(front) as link:
        wait_until(lambda: link.connected, "connected")
        assert link.call("ALMotion", "move", 1.0, 2.0, 3.0) == 6.0
    assert SECRET.encode() in front.received
    assert front.connections == 1, "one connection leads to all services of the robot"
    told = [record.getMessage() for record in caplog.records if "trusted from now on" in record.getMessage()]
    path = path_of("127.0.0.1", front.port)
    assert len(told) == 1 and path.read_text().strip() in told[0]
    assert stat.S_IMODE(path.stat().st_mode) == 0o600 and stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    front.received = b""
    with connect(front) as link:
        wait_until(lambda: link.connected, "connected again")
    assert sum("trusted" in record.getMessage() for record in caplog.records) == 1


def test_another_certificate_is_refused_with_the_remedy(front, certificates, wait_until):
    with connect(front) as link:
        wait_until(lambda: link.connected, "connected")
        front.received = b""
        front.show(certificates[1])
        path = path_of("127.0.0.1", front.port)
        wait_until(lambda: f"rm {path}" in (link.problem or ""), "the change is told")
        assert not front.received, "somebody else was spoken to"
        path.unlink()
        wait_until(lambda: link.connected, "accepted by hand")


@pytest.mark.parametrize("scheme", ["tcps", "tcp"])
def test_an_address_that_the_directory_names_gets_nothing_unless_it_is_the_robots(
    front, certificates, naoqi, wait_until, scheme
):
    """A second connection is checked like the first, and what began encrypted does not go on in the clear."""
    thief = TlsFront(naoqi.port, certificates[1] if scheme == "tcps" else None)
    directory = qi.Session()
    directory.connect(f"tcp://127.0.0.1:{naoqi.port}")
    service = directory.service("ServiceDirectory")
    place = [f"{scheme}://127.0.0.1:{thief.port}"]
    service.serviceReady(service.registerService(("ALTablet", 0, "another", os.getpid(), place, "session", "")))
    try:
        with connect(front) as link:
            wait_until(lambda: link.connected, "connected")
            with pytest.raises(RobotError, match="certificate" if scheme == "tcps" else "encrypted"):
                link.call("ALTablet", "move", 1.0, 2.0, 3.0)
            assert link.connected
        assert not thief.received
    finally:
        thief.close()
        directory.close()


def test_over_plain_tcp_no_password_is_sent(front, wait_until):
    front.show(None)
    with connect(front, "tcp") as link:
        wait_until(lambda: link.connected, "connected")
        link.call("ALMotion", "move", 0.0, 0.0, 0.0)
    assert front.received and SECRET.encode() not in front.received


def test_what_speaks_no_tls_is_said(front, wait_until):
    front.show(None)
    with connect(front) as link:
        wait_until(lambda: "TLS" in (link.problem or "") or "answer" in (link.problem or ""), "the cause")
    assert SECRET.encode() not in front.received


@pytest.mark.parametrize("harm", ["others may write", "a symbolic link", "no fingerprint"])
def test_a_pin_that_others_may_have_changed_is_not_believed(harm, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    pin = CertificatePin("pepper.local", 9503)
    pin.check(b"certificate")
    pin.check(b"certificate")
    if harm == "others may write":
        pin.path.chmod(0o666)
    elif harm == "a symbolic link":
        pin.path.rename(tmp_path / "elsewhere")
        pin.path.symlink_to(tmp_path / "elsewhere")
    else:
        pin.path.write_text("?")
    with pytest.raises(CertificateRefused, match="sha256"):
        pin.check(b"certificate")
