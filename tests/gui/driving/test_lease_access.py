"""Signing in, the lease seen from the window, and what the window then shows and does."""

import dataclasses
import threading
import time

import pytest
from cheap_passwords import CHEAP
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest

from gui.app.authorization import Authorization
from gui.app.controller import Attach, Controller
from gui.app.sign_in import SignInPage
from gui.ros.channels import Answer
from gui.window import OperatorWindow
from telepresence.teleop.accounts import UserError, Users
from telepresence.teleop.drive_lease import DriveLease
from telepresence.teleop.lease_client import JOIN_PERIOD, SILENCE, UNANSWERED_PERIOD
from telepresence.teleop.lease_messages import Reply, sign_command
from telepresence.teleop.lease_topics import Joined
from telepresence.teleop.request_to_drive import KEPT

SECRET = "correct horse"
RUNNING = {"master": True, "joined": True, "driver": True, "feed": True}
OTHER = {"pilot": "ben", "window": "/gui_ros_node_2"}


@pytest.fixture
def users(tmp_path, link):
    users = Users(tmp_path / "users.db", CHEAP)
    users.add("anna", SECRET, "pilot")
    users.add("will", SECRET, "watcher")
    link.drive_lease = DriveLease(users.find, users.of_lease()[0])
    return users


@pytest.fixture
def window(qt, link, terminal, spin, users):
    window = OperatorWindow(terminal)
    window.controller = Controller(window, link, terminal, Attach.AUTO, sign_in=True)
    window.authorization = Authorization(window, terminal, [window.controller], users)
    window.page = window.authorization.page
    window.show_on_screen()
    spin(window.isActiveWindow, "the window is active")
    yield window
    window.close()
    window.deleteLater()


def sign_in(window, spin, name, password=SECRET):
    window.page.nameField.setText(name)
    window.page.passwordField.setText(password)
    QTest.mouseClick(window.page.signInButton, Qt.LeftButton)
    spin(window.page.signInButton.isEnabled, "the password is checked")


def press(window, key):
    QTest.keyPress(window.pad, key)


def test_signed_out_nothing_is_shown_heard_sent_or_typed(window, link, terminal):
    link.become(**RUNNING)
    assert window.page.isVisible() and not window.video.isVisible()
    assert not link.open and not link.watching and link.called == []
    assert terminal.denied == "Sign in first." and terminal.lines == [] and not terminal.started
    press(window, Qt.Key_W)
    assert link.driven == []


def test_a_pilot_gets_picture_terminal_and_robot(window, link, terminal, spin):
    sign_in(window, spin, "anna")
    assert link.open and terminal.started and terminal.denied == "" and window.video.isVisible()
    link.become(**RUNNING)
    assert link.watching
    press(window, Qt.Key_W)
    assert link.driven[-1] == (0.2, 0.0, 0.0)


def test_a_watcher_gets_the_picture_only(window, link, terminal, spin):
    sign_in(window, spin, "will")
    link.become(**RUNNING)
    assert link.watching and not terminal.started and "for pilots" in terminal.denied
    link.report_lease(**OTHER)
    assert "take" not in link.asked and not window.controller.bar.takeButton.isVisible()
    press(window, Qt.Key_W)
    assert link.driven == [] and "may watch" in window.status.message
    for button in (window.sessionButton, window.roscoreButton):
        assert not button.isEnabled()
    window.controller.driving.red_stop()
    assert link.asked[-1] == "stop", "but everybody may stop the robot"


def test_signing_out_takes_it_all_back(window, link, terminal, spin):
    sign_in(window, spin, "anna")
    link.become(**RUNNING)
    press(window, Qt.Key_W)
    window.controller.bar.sign_out_wanted.emit()
    assert link.driven[-1] == (0.0, 0.0, 0.0) and link.asked[-1] == "leave"
    assert not link.open and not link.watching and window.page.isVisible() and terminal.denied
    assert window.page.passwordField.text() == ""


def test_a_wrong_password_is_said_and_the_name_stays(window, link, spin):
    sign_in(window, spin, "anna", "wrong")
    assert "Wrong name or password" in window.page.signInMessage.text() and window.page.isVisible()
    assert window.page.nameField.text() == "anna" and window.page.passwordField.text() == ""


def test_what_is_typed_while_a_password_is_checked_is_checked_next(window, spin, users, monkeypatch):
    checks, check = [], users.check
    go_on = threading.Event()

    def slow_check(name, password, **more):
        checks.append(password)
        go_on.wait(30.0)
        return check(name, password, **more)

    monkeypatch.setattr(users, "check", slow_check)
    for password in ("wrong", SECRET):
        window.page.nameField.setText("anna")
        window.page.passwordField.setText(password)
        QTest.keyClick(window.page.passwordField, Qt.Key_Return)
    go_on.set()
    spin(lambda: window.authorization.account is not None, "the second password was checked")
    assert checks == ["wrong", SECRET] and window.page.passwordField.text() == ""


def test_the_page_says_that_a_try_waits(window, spin, users):
    for _ in range(5):
        with pytest.raises(UserError):
            users.check("anna", "wrong")
    said = []
    window.page._waits.connect(lambda seconds: said.append(window.page.signInMessage.text()))
    sign_in(window, spin, "anna")
    spin(lambda: said, "it says so")
    assert "waits for 1 s" in said[0] and window.authorization.account.name == "anna"


def test_without_accounts_the_page_says_how_to_make_one(qt, tmp_path):
    page = SignInPage(Users(tmp_path / "none.db"))
    page.show()
    assert "python -m gui.users add" in page.signInMessage.text()
    page.try_sign_in()
    assert "Type your name" in page.signInMessage.text()
    page.close()


def test_commands_carry_the_proof_of_the_session(window, link, spin):
    sign_in(window, spin, "anna")
    link.become(**RUNNING)
    press(window, Qt.Key_W)
    (_, claim, *_), *_ = (call for call in link.called if call[0] == "join")
    _, session, command = next(sent for sent in reversed(link.sent) if sent[0] == "command")
    unsigned = dataclasses.replace(command, proof=b"")
    assert (claim.name, claim.node) == ("anna", link.node_name)
    assert command.proof == sign_command(link.windows[session].key, unsigned)


def test_a_drive_lease_that_cannot_prove_itself_is_said_and_sent_nothing(window, link, spin, monkeypatch):
    monkeypatch.setattr("fake_window_parts.sign_joined", lambda key: bytes(16))
    sign_in(window, spin, "anna")
    link.become(**RUNNING)
    press(window, Qt.Key_W)
    assert link.driven == [] and "cannot prove" in window.controller.access.obstacle()


def test_a_removed_account_is_signed_out_and_told_why(pilot, link, spin):
    link.replies["present"] = Reply(False, "The account of anna was removed from this robot.", ended=True)
    link.lease["present"] = ()
    spin(lambda: link.report_lease() or pilot.page.isVisible(), "the window asks why it is missing")
    assert "was removed" in pilot.page.signInMessage.text() and not pilot.video.isVisible()
    assert not link.open and pilot.controller.access.account is None


def test_an_answer_that_is_not_signed_makes_the_window_join_anew(pilot, link):
    before = pilot.controller.access.client.session
    del link.windows[before]
    pilot.controller.access.ask("present")
    assert pilot.controller.access.client.session not in ("", before)


@pytest.fixture
def pilot(window, link, spin):
    """A window whose pilot has signed in."""
    sign_in(window, spin, "anna")
    link.become(**RUNNING)
    link.called.clear()
    return window


def test_a_free_robot_is_taken_and_one_that_was_lost_to_another_is_not(pilot, link):
    link.report_lease(pilot="", window="")
    assert link.asked == ["take"]
    link.report_lease(pilot="anna", window=link.node_name)
    link.report_lease(**OTHER)
    assert "ben drives now" in pilot.status.message
    link.called.clear()
    link.report_lease(pilot="", window="")
    assert link.asked == []


def test_who_drives_is_shown_and_can_be_asked(pilot, link):
    link.report_lease(**OTHER)
    assert "ben drives" in pilot.controller.bar.menuButton.text()
    press(pilot, Qt.Key_W)
    assert link.driven == [] and "ben drives. Press Ask for it." in pilot.status.message
    assert pilot.controller.bar.takeButton.text() == "Ask for it"
    pilot.controller.bar.takeButton.click()
    assert link.asked == ["take"]


def test_a_request_can_be_granted_or_not(pilot, link):
    link.report_lease(asking="ben")
    bar = pilot.controller.bar
    assert "ben asks to drive" in bar.menuButton.text() and bar.takeButton.text() == "Hand over"
    bar.keepButton.click()
    bar.takeButton.click()
    assert link.asked == ["keep", "give"]


def test_who_asked_in_vain_is_told(pilot, link, spin):
    link.report_lease(**OTHER)
    link.report_lease(asking="anna")
    link.report_lease(asking="")
    link.report_lease(asking="anna")
    link.report_lease(asking="will")
    QTest.qWait(round(1500 * KEPT))
    assert "keeps" not in pilot.status.message, "it was silent for a moment, and then somebody else asked"
    link.report_lease(asking="anna")
    link.report_lease(asking="")
    spin(lambda: pilot.status.message == "ben keeps the robot.", "it is said")


def test_losing_the_robot_to_another_stops_the_hands(pilot, link):
    press(pilot, Qt.Key_W)
    link.report_lease(**OTHER)
    assert link.driven[-1] == (0.0, 0.0, 0.0) and not pilot.pad.held


def test_the_red_stop_shows_who_pressed_it_and_is_let_go(pilot, link, monkeypatch):
    controls = pilot.controller.controls
    press(pilot, Qt.Key_W)
    controls.redStop.click()
    assert link.asked[-1] == "stop" and ("stop_drive",) in link.called and link.driven[-1] == (0.0, 0.0, 0.0)
    link.report_lease(stopped_by="will", hold="will has pressed the red stop.")
    assert "STOPPED by will" in controls.redStop.text()
    QTest.keyRelease(pilot.pad, Qt.Key_W)
    link.sent.clear()
    press(pilot, Qt.Key_A)
    assert all(velocity == (0.0, 0.0, 0.0) for velocity in link.driven) and "red stop" in pilot.status.message
    controls.redStop.click()
    assert link.asked[-1] == "stop", "a second press in a fright does not reset it"
    monkeypatch.setattr("gui.driving.drive_controls.PANIC_TIME", 0.0)
    controls.redStop.click()
    assert link.asked[-1] == "reset_stop"


def test_the_red_stop_stops_when_it_goes_down_and_a_long_press_is_one_press(pilot, link, monkeypatch):
    monkeypatch.setattr("gui.driving.drive_controls.PANIC_TIME", 0.0)
    stop = pilot.controller.controls.redStop
    QTest.mousePress(stop, Qt.LeftButton)
    assert link.asked == ["stop"], "the hand may slip off"
    link.report_lease(stopped_by="anna", hold="anna has pressed the red stop.")
    QTest.mouseRelease(stop, Qt.LeftButton)
    assert link.asked == ["stop"]
    QTest.mouseClick(stop, Qt.LeftButton)
    assert link.asked == ["stop", "reset_stop"]


def test_a_stop_of_the_safety_layer_shows_too(pilot, link):
    link.channel("safety_text").arrived.emit("stopped: Stopped: stop requested.")
    assert "STOPPED by the safety gate" in pilot.controller.controls.redStop.text()
    press(pilot, Qt.Key_W)
    assert link.driven == []
    link.channel("safety_text").arrived.emit("clear: Way is free.")
    assert pilot.controller.controls.redStop.text().startswith("STOP\n")


def test_an_arbiter_that_falls_silent_ends_driving(pilot, link, spin, monkeypatch):
    monkeypatch.setattr("telepresence.teleop.lease_client.SILENCE", SILENCE / 5)
    link.repeats.stop()
    spin(lambda: pilot.controller.access.state is None, "it counts as gone")
    press(pilot, Qt.Key_W)
    assert link.driven == [] and "drive_lease" in pilot.status.message


def test_a_new_arbiter_is_joined_again(pilot, link):
    link.report_lease(epoch="2", pilot="", window="")
    assert [call[0] for call in link.called] == ["join", "join", "ask"] and link.asked == ["take"]


def test_a_new_arbiter_is_joined_although_the_old_one_has_not_answered(pilot, link, spin, monkeypatch):
    """A call that a killed node has taken is answered by nobody for seconds."""
    access, lost = pilot.controller.access, []
    with monkeypatch.context() as patched:
        patched.setattr(link, "call", lambda *call, then: lost.append(then))
        link.report_lease(epoch="2", pilot="", window="")
    assert len(lost) == 1 and not access.client.session
    spin(lambda: link.report_lease(epoch="3", pilot="", window="") or access.client.session, "it joins the new one")
    session = access.client.session
    lost[0](Answer(False, "drive/join did not answer within 3 s."))
    assert access.client.session == session and access.obstacle() == "Nobody drives. Press Take the robot."


def test_an_arbiter_that_does_not_answer_is_asked_again_sooner_than_one_that_refuses(pilot, link, spin, monkeypatch):
    access, asked = pilot.controller.access, []
    answers = [Answer(False, "it is not ready"), Answer(False, "Wrong name.", Joined("", b"", b""))]
    monkeypatch.setattr(link, "call", lambda name, *_, then: asked.append(name) or then(answers[len(asked) - 1]))
    began = time.monotonic()
    link.report_lease(epoch="2", pilot="", window="")
    spin(lambda: link.report_lease() or len(asked) == 2, "it asks again")
    assert time.monotonic() - began > UNANSWERED_PERIOD and access.obstacle() == "Wrong name."
    assert access.client._join_at > began + JOIN_PERIOD


def test_the_speed_limit_reaches_the_pad(pilot, link):
    controls = pilot.controller.controls
    controls.step_speed(100)
    press(pilot, Qt.Key_W)
    assert link.driven[-1][0] == pytest.approx(controls.speed) and controls.speed == pytest.approx(0.35)
    controls.step_speed(-100)
    assert pilot.pad.speed == pytest.approx(0.05)


def test_a_restart_is_for_who_drives(pilot, link):
    pilot.controller.gamepad.restart_wanted.emit()
    assert ("restart_simulation",) in link.called
    link.called.clear()
    link.report_lease(**OTHER)
    pilot.controller.gamepad.restart_wanted.emit()
    assert ("restart_simulation",) not in link.called


def test_what_is_sent_is_dated_by_a_clock_that_counts_sleep(window, link, spin, monkeypatch):
    """The lease takes it for late otherwise, for as long as the computer has slept."""
    sign_in(window, spin, "anna")
    link.become(**RUNNING)
    awake = time.monotonic()
    monkeypatch.setattr(time, "clock_gettime", {time.CLOCK_BOOTTIME: awake + 3600.0}.get)
    press(window, Qt.Key_W)
    command = next(values[1] for name, *values in reversed(link.sent) if name == "command")
    assert command.sent == awake + 3600.0 and link.driven[-1] == (0.2, 0.0, 0.0)
