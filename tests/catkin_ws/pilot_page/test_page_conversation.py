"""Sound both ways and the pilot's face by the page: Chromium with a recorded microphone and camera, the nodes `voice`
and `com_cam`, and the simulated Pepper, whose loudspeaker and tablet are looked at."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from page_browser import Browser, enter
from page_sound import ORANGE, SETTLED, Likeness, camera, devices, microphone, recorded
from repeated_presses import press_until
from sound_lab import RATE, sentence

from pepper_sim.simulation import Simulation

pytestmark = [pytest.mark.ros, pytest.mark.browser]

PILOT_SAYS = "Good morning. May I come in?"
ROOM = (20, 90, 230)
ROBOT_HEARS = "Please be careful, the cat is asleep."


@pytest.fixture(scope="module")
def spoken(tmp_path_factory) -> tuple[np.ndarray, Path]:
    """What the browser's microphone records, again and again, and the file of it."""
    path = tmp_path_factory.mktemp("microphone") / "pilot.wav"
    return microphone(path, PILOT_SAYS), path


@pytest.fixture(scope="module")
def face(tmp_path_factory) -> Path:
    """What the browser's camera films."""
    path = tmp_path_factory.mktemp("camera") / "pilot.y4m"
    camera(path)
    return path


@pytest.fixture(scope="module")
def station_camera(tmp_path_factory) -> Path:
    """What the camera beside the robot's programs films: nobody has asked for it on the tablet."""
    path = tmp_path_factory.mktemp("station") / "room.png"
    cv2.imwrite(str(path), np.full((480, 640, 3), ROOM[::-1], np.uint8))
    return path


@pytest.fixture(scope="module")
def robot(graph, station_camera):
    robot = Simulation("empty", 0, "127.0.0.1", graph.robot_port)
    voice = graph.run_node(
        *("telepresence_1", "voice", "_microphone:=none", "_speaker:=none", "_patience:=0.2"),
        f"_rtp_port:={graph.free_port()}",
    )
    face = graph.run(
        str(graph.workspace / "lib/telepresence_1/com_cam.py"),
        *(f"--qi-url=tcp://127.0.0.1:{graph.robot_port}", "_port:=0", "_show_on_tablet:=false"),
        f"_source:={station_camera}",
    )
    yield robot
    voice.end()
    face.end()
    robot.close()


@pytest.fixture(scope="module")
def driver(running, robot, spoken, face, wait_until):
    browser = Browser(running[1], SETTLED, devices(spoken[1], face))
    with contextlib.closing(browser.tools):
        yield enter(browser, wait_until)


def press(browser: Browser, name: str) -> None:
    browser.evaluate(f"document.getElementById('{name}').click()")


def is_pressed(browser: Browser, name: str) -> bool:
    return browser.evaluate(f"document.getElementById('{name}').ariaPressed === 'true'")


def hide(browser: Browser, hidden: bool) -> None:
    browser.evaluate(
        f"Object.defineProperty(document, 'hidden', {{ configurable: true, get: () => {str(hidden).lower()} }});"
        "document.dispatchEvent(new Event('visibilitychange'))"
    )


def played(robot: Simulation, seconds: float) -> np.ndarray:
    """What the robot's loudspeaker has played just now."""
    return robot.room.loudspeaker.track.render(time.monotonic() - seconds, int(seconds * RATE), RATE)


def is_silent(robot: Simulation) -> bool:
    return float(np.abs(played(robot, 0.4)).max()) < 0.001


@pytest.mark.alone
def test_the_pilot_s_voice_comes_out_of_the_robot_while_the_microphone_is_open(driver, robot, spoken, wait_until):
    wait_until(lambda: not driver.evaluate("document.getElementById('tool_microphone').hidden"), "one can speak")
    assert is_silent(robot) and not is_pressed(driver, "tool_microphone")
    press(driver, "tool_microphone")
    wait_until(lambda: "Your voice comes out" in driver.text("section_sound"), "the robot gets the voice")
    likeness, period = Likeness(spoken[0]), len(spoken[0]) / RATE
    wait_until(lambda: time.sleep(period / 2) or likeness.listen(played(robot, 2 * period)), lambda: likeness.best)
    print("likeness", [f"{value:.3f}" for value in likeness.best])
    press(driver, "tool_microphone")
    wait_until(lambda: is_silent(robot), "the microphone is muted")
    driver.key("KeyV", True)
    wait_until(lambda: not is_silent(robot), "the key talks while it is held")
    driver.key("KeyV", False)
    wait_until(lambda: is_silent(robot), "and no longer")
    talk = "document.getElementById('talk').dispatchEvent(new {})"
    for press_it, let_go in (
        (
            lambda: driver.key("KeyV", True),
            lambda: driver.evaluate("dispatchEvent(new KeyboardEvent('keyup', {key: 'Meta'}))"),
        ),
        (
            lambda: driver.evaluate(talk.format("KeyboardEvent('keydown', {code: 'Enter'})")),
            lambda: driver.evaluate(talk.format("FocusEvent('blur')")),
        ),
    ):
        press_it()
        wait_until(lambda: not is_silent(robot), "held again")
        let_go()
        wait_until(lambda: is_silent(robot), "its release is not seen, as on a Mac, or after Tab")
    driver.key("KeyV", False)
    driver.key("KeyM", True)
    wait_until(lambda: not is_silent(robot), "the other key opens it")
    hide(driver, True)
    wait_until(lambda: is_silent(robot), "nobody speaks by a hidden page")
    hide(driver, False)
    assert not is_pressed(driver, "tool_microphone") and driver.errors == []


@pytest.mark.alone
def test_the_page_hears_what_is_said_beside_the_robot(driver, robot, wait_until):
    wait_until(lambda: is_pressed(driver, "tool_speaker"), "the page listens by itself")
    theirs = sentence(ROBOT_HEARS, "en-gb")
    likeness = Likeness(theirs)

    def heard() -> bool:
        robot.room.surroundings.play(theirs, RATE, time.monotonic() + 0.2)
        return likeness.listen(recorded(driver, len(theirs) / RATE + 1.5))

    wait_until(heard, lambda: likeness.best)
    print("likeness", [f"{value:.3f}" for value in likeness.best])
    press(driver, "tool_speaker")
    wait_until(lambda: not is_pressed(driver, "tool_speaker"), "the robot is muted")
    robot.room.surroundings.play(theirs, RATE)
    assert driver.evaluate("document.getElementById('robotSound').srcObject.getAudioTracks()[0].readyState") == "live"
    press(driver, "tool_speaker")
    wait_until(lambda: is_pressed(driver, "tool_speaker"), "it is listened to again")


def test_the_face_is_on_the_robot_s_tablet_and_covered_while_the_page_is_hidden(driver, robot, wait_until):
    def on_tablet() -> tuple[int, ...]:
        picture = robot.tablet.image.peek()
        return (0, 0, 0) if picture is None else tuple(map(int, picture.content[200, 320]))

    def shows(colour: tuple[int, ...]) -> bool:
        seen.append(on_tablet())
        return max(abs(a - b) for a, b in zip(seen[-1], colour, strict=True)) < 20

    def shows_face() -> bool:
        return shows(ORANGE)

    seen: list[tuple[int, ...]] = []

    wait_until(lambda: not driver.evaluate("document.getElementById('tool_camera').hidden"), "one can be seen")
    assert not shows_face() and not is_pressed(driver, "tool_camera")
    press(driver, "tool_camera")
    wait_until(shows_face, on_tablet)
    assert driver.evaluate("!document.getElementById('selfView').hidden"), "the pilot sees what they see"
    hide(driver, True)
    wait_until(lambda: not shows_face(), "the camera is paused")
    hide(driver, False)
    wait_until(shows_face, on_tablet)
    press(driver, "tool_camera")
    seen.clear()
    wait_until(lambda: not shows_face() and not robot.tablet.visible, "the camera is off, and the page with it")
    assert not any(max(abs(a - b) for a, b in zip(colour, ROOM, strict=True)) < 20 for colour in seen), seen
    press(driver, "tool_camera")
    wait_until(shows_face, "the page comes back with the face")
    press(driver, "tool_camera")
    wait_until(lambda: not robot.tablet.visible, "and goes with it again")
    assert driver.errors == []


def test_the_robot_says_a_sentence(driver, graph, wait_until):
    said = graph.probe()
    said.watch("/speech", "std_msgs/String", ["data"])
    wait_until(lambda: not driver.evaluate("document.getElementById('tool_say').hidden"), "the robot can speak")
    press(driver, "tool_say")
    driver.tools.call("Input.insertText", text="May I come in?")
    driver.evaluate("document.getElementById('sayForm').requestSubmit()")
    wait_until(lambda: said.newest("/speech") == ["May I come in?"], "it says so")
    wait_until(lambda: driver.evaluate("document.getElementById('sentence').value") == "", "and the next one can come")


def test_who_loses_the_robot_is_told_that_microphone_and_camera_are_off(driver, open_page, wait_until):
    """A browser that was not run for a second loses the robot, too: then both are opened again."""
    names = "tool_microphone", "tool_camera"
    driver.evaluate(
        "globalThis.said = ''; new MutationObserver(() => said += document.getElementById('alert').textContent)"
        ".observe(document.getElementById('alert'), { childList: true })"
    )

    def press_both() -> None:
        for name in names:
            if not is_pressed(driver, name):
                press(driver, name)

    press_until(
        *(press_both, lambda: None, wait_until),
        *(lambda: all(is_pressed(driver, name) for name in names), "both are open"),
    )
    other = enter(open_page(), wait_until)
    for device in ("microphone", "camera"):
        off = f"Your {device} is off: you do not have the robot any more."
        wait_until(lambda off=off: off in driver.evaluate("said"), off)
    wait_until(lambda: "anna drives now." in driver.evaluate("said"), "and who has it")
    assert not any(is_pressed(driver, name) for name in names)
    assert driver.errors == other.errors == []
