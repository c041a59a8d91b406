"""Nobody is filmed for somebody who has gone: a recording ends when whoever may have started it is signed out."""

import pytest
from cheap_passwords import CHEAP

from gui.__main__ import authorize, make_tabs, one_window, parse
from gui.ros.node import RosNode
from gui.settings import Settings
from telepresence.teleop.accounts import Users
from telepresence.teleop.lease_messages import PILOT, Account

REMOVED = "The account of anna was removed from this robot."


@pytest.fixture
def window(qt, fake_ros, tmp_path):
    """What main opens, with anna signed in."""
    users, settings = Users(tmp_path / "users.db", CHEAP), Settings(tmp_path / "window.ini")
    users.add("anna", "correct horse", PILOT)
    tabs = make_tabs(RosNode(), parse(["--profile", "both", "--folder", str(fake_ros)]), settings)
    window, _front = one_window(tabs, settings)
    window.tabs_of_robots, window.authorization = tabs, authorize(tabs, window, users)
    window.authorization.admit(Account("anna", PILOT))
    yield window
    for tab in tabs:
        tab.close()
        tab.terminal.close_terminal()
    window.deleteLater()


@pytest.mark.parametrize("removed", [False, True], ids=["signed out", "removed"])
def test_a_recording_ends_with_the_sign_in_and_the_page_says_where_it_is(window, fake_ros, spin, removed):
    captures = [tab.capture for tab in window.tabs_of_robots]
    page = window.authorization.page
    for name, capture in zip(("pepper", "robotino"), captures, strict=True):
        capture.recorder.start(name, ["/odom"], "/camera/compressed")
    spin(lambda: len([*fake_ros.glob("*.[bm]*")]) == 4, "both recordings have begun")
    assert page.signInMessage.text() == ""
    for tab in window.tabs_of_robots:
        if removed:
            tab.controller.access.ended.emit(REMOVED)
        else:
            tab.controller.bar.sign_out_wanted.emit()
    assert f"The recording is being closed. It is in {fake_ros}." in page.signInMessage.text()
    assert page.signInMessage.text().count(REMOVED) == removed
    spin(lambda: not any(capture.recorder.recording for capture in captures), "nobody is filmed any more")
    for end in ("pepper.html", "robotino.html", "pepper.mp4", "robotino.mp4"):
        spin(lambda end=end: f"{fake_ros / end}" in page.signInMessage.text(), f"{end} is said")


def test_what_is_said_of_a_recording_to_somebody_who_is_signed_in_is_not_left_for_the_next(window, fake_ros, spin):
    capture = window.tabs_of_robots[0].capture
    capture.recorder.start("pepper", ["/odom"])
    spin((fake_ros / "pepper.bag").exists, "the recording has begun")
    capture.recorder.stop()
    spin(lambda: "pepper.html" in window.tabs_of_robots[0].window.status.message, "the report is said")
    window.authorization.dismiss()
    assert window.authorization.page.signInMessage.text() == ""
