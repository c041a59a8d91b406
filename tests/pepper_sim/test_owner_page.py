"""The owner's consent: given and withdrawn on the robot's page, obeyed by ALMotion. tests/attacks attacks the page."""

from __future__ import annotations

import contextlib
import http.client
from collections.abc import Callable, Iterator

import pytest

from pepper_sim import owner_page
from pepper_sim.simulation import SimulatedPepper

KEY = "a key of the test's own"
FORM = {"Content-Type": "application/x-www-form-urlencoded"}


class Owner:
    """A person's browser at the page of the robot, which keeps the cookie."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._place, self._cookie = "/", ""

    def ask(self, method: str, path: str, body: bytes | None = None, **headers: str) -> tuple[int, str]:
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", self._port, timeout=10.0)) as client:
            client.request(method, self._place + path, body, {"Cookie": self._cookie, **headers})
            answer = client.getresponse()
            if answer.status == 302:
                self._place, self._cookie = answer.headers["Location"], answer.headers["Set-Cookie"].partition(";")[0]
            return answer.status, answer.read().decode()

    def consent(self, given: bool) -> None:
        assert self.ask("POST", "consent", b"programs=%d" % given, **FORM)[0] == 303


@pytest.fixture
def open_page(naoqi) -> Iterator[Callable[[], Owner]]:
    """Serve the page of the shared robot and open it."""
    with contextlib.closing(owner_page.serve(naoqi.robot.consent, "127.0.0.1", 0, KEY)) as server:

        def open_it() -> Owner:
            owner = Owner(server.port)
            assert owner.ask("GET", owner_page.address_with_key(server, KEY).removeprefix(server.url))[0] == 302
            return owner

        yield open_it


def test_programs_may_switch_reflexes_off_while_the_owner_consents(naoqi, refused, open_page):
    motion, owner = naoqi.ALMotion, open_page()
    assert "may not" in owner.ask("GET", "")[1]
    assert "consent" in refused(motion.setExternalCollisionProtectionEnabled, "All", False)
    owner.consent(True)
    assert "may not" not in owner.ask("GET", "")[1]
    motion.setExternalCollisionProtectionEnabled("All", False)
    motion.setFallManagerEnabled(False)
    motion.setPushRecoveryEnabled(False)
    assert not naoqi.robot.security.enabled and not motion.getExternalCollisionProtectionEnabled("Move")
    assert not motion.getFallManagerEnabled() and not motion.getPushRecoveryEnabled()
    owner.consent(False)
    assert naoqi.robot.security.enabled and motion.getExternalCollisionProtectionEnabled("Move")
    assert motion.getFallManagerEnabled() and motion.getPushRecoveryEnabled()
    assert "consent" in refused(motion.setExternalCollisionProtectionEnabled, "Move", False)


def test_a_restarted_robot_is_as_careful_as_at_the_start(naoqi, refused):
    naoqi.robot.consent.given = True
    naoqi.ALMotion.setExternalCollisionProtectionEnabled("All", False)
    naoqi.simulation.restart()
    assert naoqi.robot.security.enabled
    assert "consent" in refused(naoqi.ALMotion.setExternalCollisionProtectionEnabled, "All", False)


@pytest.mark.parametrize("body", [b"", b"programs=2", b"programs=1&x=1", b"x" * 1000, b"\xff"], ids=len)
def test_only_the_pages_own_form_is_taken(naoqi, open_page, body):
    owner = open_page()
    assert owner.ask("POST", "consent", body, **FORM)[0] == 400
    assert owner.ask("GET", "consent")[0] == owner.ask("POST", "", b"programs=1", **FORM)[0] == 405
    assert owner.ask("GET", "elsewhere")[0] == 404
    assert not naoqi.robot.consent.given


def test_listening_for_other_machines_is_warned_about(naoqi, caplog):
    owner_page.serve(naoqi.robot.consent, "0.0.0.0", 0, KEY).close()
    assert "crosses the network in the clear" in caplog.text


def test_page_is_left_out_unless_asked_for_and_then_on_loopback():
    assert SimulatedPepper().page_url is None
    assert SimulatedPepper(page_port=0)._page == ("127.0.0.1", 0)
