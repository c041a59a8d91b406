"""Looking around by the page: drag, keys, buttons, thumb and gamepad; who may, and what ends it."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from pathlib import Path

import pytest
from page_browser import Browser, enter, hold_until

pytestmark = [pytest.mark.ros, pytest.mark.browser]

HEAD = Path(__file__).resolve().parents[2] / "lab" / "robot_head.py"
RATE, GOAL, AHEAD, WAY = 1, 2, 3, 4
FOCAL = 145.0
"""Focal length of the camera [px]."""
REST = 0.5
"""Seconds within which a head stands that nobody turns."""
AGAIN = 5.0
"""[s] from one gesture to the next."""
QUIET = 0.3
"""Seconds without a look after which no page sends any."""


@pytest.fixture(scope="module")
def looks(graph, running):
    graph.run(sys.executable, str(HEAD))
    probe = graph.probe()
    probe.watch("/head/look", "telepresence_msgs/HeadLook", ["manner", "yaw", "pitch"])
    probe.watch("/head/state", "telepresence_msgs/HeadState", ["yaw", "pitch"])
    return probe


@pytest.fixture(scope="module")
def anna(running, looks, wait_until):
    browser = Browser(running[1])
    with contextlib.closing(browser.tools):
        enter(browser, wait_until)
        wait_until(lambda: browser.evaluate("!document.getElementById('lookPad').hidden"), "the robot has a head")
        yield browser


def heard(probe):
    return [fields for _, fields in probe.seen("/head/look")]


def where(probe):
    return probe.latest("/head/state")


def mouse(browser, kind, x, y):
    """A mouse event at shares of the picture."""
    box = browser.evaluate(
        "(() => { const b = document.getElementById('picture').getBoundingClientRect();"
        " return [b.left, b.top, b.width, b.height]; })()"
    )
    browser.tools.call(
        "Input.dispatchMouseEvent", type=kind, x=box[0] + x * box[2], y=box[1] + y * box[3], button="left",
        buttons=0 if kind == "mouseReleased" else 1, clickCount=1,
    )  # fmt: skip


def centre(browser, looks, wait_until):
    ahead = lambda: where(looks) == pytest.approx([0.0, 0.15], abs=1e-3)  # noqa: E731
    hold_until(browser, wait_until, ahead, "straight ahead", "KeyH")
    browser.key("KeyH", False)
    wait_until(
        lambda: all(time.time() - when > QUIET for when, _ in looks.seen("/head/look")[-1:]), "and nothing turns it"
    )
    looks.forget("/head/look")


def turn_to(browser, looks, wait_until, gesture, wanted, what):
    """Turn the head from straight ahead to `wanted`: yaw and pitch [rad]. A page whose picture is late, on a busy
    machine, takes no gesture and ends one: then it is made again."""
    made = -math.inf

    def turned() -> bool:
        nonlocal made
        if where(looks) == pytest.approx(wanted, abs=0.01):
            return True
        if time.monotonic() - made > AGAIN:
            centre(browser, looks, wait_until)
            gesture()
            made = time.monotonic()
        return False

    wait_until(turned, what)


def test_what_is_dragged_stays_under_the_pointer(anna, looks, wait_until):
    def drag() -> None:
        mouse(anna, "mousePressed", 0.5, 0.5)
        for step in range(1, 6):
            mouse(anna, "mouseMoved", 0.5 + 0.05 * step, 0.5 + 0.02 * step)
        mouse(anna, "mouseReleased", 0.75, 0.6)

    pixels = 40, 12  # of the camera
    wanted = [math.atan2(pixels[0], FOCAL), 0.15 - math.atan2(pixels[1], FOCAL)]
    turn_to(anna, looks, wait_until, drag, wanted, "the head has followed")
    assert {manner for manner, _, _ in heard(looks)} == {GOAL}
    mark = "parseFloat(document.getElementById('aheadMark').style.left)"
    wait_until(lambda: anna.evaluate(mark) == pytest.approx(75, abs=1), "the mark is where the middle was [%]")
    assert "left" in anna.text("headChip")


def test_a_key_turns_the_head_while_it_is_held(anna, looks, wait_until):
    centre(anna, looks, wait_until)
    right = lambda: len([1 for manner, yaw, _ in heard(looks) if manner == RATE and yaw < 0]) > 5  # noqa: E731
    hold_until(anna, wait_until, right, "it turns right", "KeyL")
    anna.key("KeyL", False)
    wait_until(lambda: heard(looks)[-2:] == [[RATE, 0.0, 0.0]] * 2, "the release stops it, more than once")


def test_a_press_without_a_pointer_turns_by_one_step(anna, looks, wait_until):
    click = lambda: anna.evaluate("document.querySelector('[data-look=look_left]').click()")  # noqa: E731
    turn_to(anna, looks, wait_until, click, [0.26, 0.15], "one step to the left")


def test_looking_where_i_drive_is_repeated_until_something_else_turns_the_head(anna, looks, wait_until):
    centre(anna, looks, wait_until)
    anna.evaluate("document.querySelector('[data-look=way]').click()")
    wait_until(lambda: heard(looks)[-5:] == [[WAY, 0.0, 0.0]] * 5, "it is said again and again")
    assert anna.evaluate("document.querySelector('[data-look=way]').getAttribute('aria-pressed')") == "true"
    hold_until(anna, wait_until, lambda: heard(looks)[-1][0] == RATE, "a key takes over", "KeyJ")
    anna.key("KeyJ", False)
    wait_until(lambda: heard(looks)[-1] == [RATE, 0.0, 0.0], "and stays in charge")


def test_the_right_stick_turns_the_head_with_its_modifier_only(anna, looks, wait_until):
    centre(anna, looks, wait_until)
    anna.evaluate(
        "globalThis.tilted = { connected: true, index: 0, axes: [0, 0, 0.9, 0],"
        " buttons: Array.from({ length: 17 }, () => ({ pressed: false })) };"
        "navigator.getGamepads = () => [globalThis.tilted]"
    )
    time.sleep(0.3)  # of a stick without its modifier
    assert heard(looks) == []
    anna.evaluate("globalThis.tilted.buttons[6].pressed = true")
    wait_until(lambda: any(manner == RATE and yaw < 0 for manner, yaw, _ in heard(looks)), "with LT it turns right")
    anna.evaluate("navigator.getGamepads = () => []")
    wait_until(lambda: heard(looks)[-1] == [RATE, 0.0, 0.0], "a pad that is gone turns nothing")


def test_a_page_that_is_not_looked_at_turns_nothing(anna, looks, wait_until):
    centre(anna, looks, wait_until)
    hold_until(anna, wait_until, lambda: len(heard(looks)) > 3, "it turns", "KeyJ")
    anna.evaluate(
        "Object.defineProperty(document, 'hidden', { configurable: true, get: () => true });"
        "document.dispatchEvent(new Event('visibilitychange'))"
    )
    hidden = time.time()
    time.sleep(REST + 0.3)  # in which no look may come late
    late = [fields for when, fields in looks.seen("/head/look") if when > hidden + REST and any(fields[1:])]
    anna.evaluate("delete document.hidden; document.dispatchEvent(new Event('visibilitychange'))")
    anna.key("KeyJ", False)
    assert late == []


def test_a_watcher_cannot_turn_the_head(anna, looks, open_page, wait_until):
    centre(anna, looks, wait_until)
    will = open_page()
    wait_until(lambda: will.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is")
    will.sign_in("will")
    wait_until(lambda: "may watch" in will.text("status"), "the page is there")
    will.key("KeyJ", True)
    time.sleep(0.4)  # of trying
    will.key("KeyJ", False)
    will.evaluate("document.querySelector('[data-look=look_left]').click()")
    wait_until(lambda: "may watch" in will.text("alert"), "the page says why")
    assert heard(looks) == [] and anna.errors == [] and will.errors == []
