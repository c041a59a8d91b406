"""Sound both ways and the pilot's face by the page: Chromium with a recorded microphone and camera, the nodes `voice`
and `com_cam`, and the simulated Pepper, whose loudspeaker and tablet are looked at."""

from __future__ import annotations

import base64
import time
from pathlib import Path

import numpy as np
import pytest
from page_browser import Browser, enter
from sound_lab import RATE, match, sentence

from pepper_sim.simulation import Simulation
from pepper_sim.sound.room import write_wave

pytestmark = [pytest.mark.ros, pytest.mark.browser]

PILOT_SAYS = "Good morning. May I come in?"
ROBOT_HEARS = "Please be careful, the cat is asleep."
PIECE = 0.5
"""[s] of speech that are compared at a time."""
LIKENESS = 0.9
"""As between the microphone and the robot, see test_voice.py."""
PAUSE = 1.0
"""[s] between two times that the sentence is said."""
RECORD = """
(async (seconds) => {
  const track = document.getElementById("robotSound").srcObject.getAudioTracks()[0];
  const reader = new MediaStreamTrackProcessor({ track }).readable.getReader();
  const words = [];
  for (let count = 0; count < seconds * 48000;) {
    const { value } = await reader.read();
    const samples = new Float32Array(value.numberOfFrames);
    value.copyTo(samples, { planeIndex: 0, format: "f32-planar" });
    for (const sample of samples) words.push(Math.round(sample * 32767));
    count += samples.length;
    value.close();
  }
  reader.cancel();
  const bytes = new Uint8Array(Int16Array.from(words).buffer);
  let text = "";
  for (let at = 0; at < bytes.length; at += 8192) text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return btoa(text);
})"""
ORANGE = (240, 120, 20)
SETTLED = "localStorage.setItem('sound', JSON.stringify({headset: true}))"
"""A voice that is left as it is can be compared."""


@pytest.fixture(scope="module")
def spoken(tmp_path_factory) -> tuple[np.ndarray, Path]:
    """What the browser's microphone records, again and again, and the file of it."""
    samples = np.concatenate([sentence(PILOT_SAYS), np.zeros(int(PAUSE * RATE), np.float32)])
    path = tmp_path_factory.mktemp("microphone") / "pilot.wav"
    write_wave(path, samples, RATE)
    return samples, path


@pytest.fixture(scope="module")
def face(tmp_path_factory) -> Path:
    """What the browser's camera films: one colour."""
    path = tmp_path_factory.mktemp("camera") / "pilot.y4m"
    red, green, blue = (part / 255 for part in ORANGE)
    levels = (  # ITU-R BT.601, 2.5.3
        16 + 65.5 * red + 128.6 * green + 25.0 * blue,
        128 - 37.8 * red - 74.2 * green + 112.0 * blue,
        128 + 112.0 * red - 93.8 * green - 18.2 * blue,
    )
    sizes = (640 * 480, 320 * 240, 320 * 240)
    planes = b"".join(bytes([round(level)]) * size for level, size in zip(levels, sizes, strict=True))
    path.write_bytes(b"YUV4MPEG2 W640 H480 F15:1 Ip A1:1 C420mpeg2\n" + 4 * (b"FRAME\n" + planes))
    return path


@pytest.fixture(scope="module")
def robot(graph):
    robot = Simulation("empty", 0, "127.0.0.1", graph.robot_port)
    voice = graph.run_node(
        *("telepresence_1", "voice", "_microphone:=none", "_speaker:=none", "_patience:=0.2"),
        f"_rtp_port:={graph.free_port()}",
    )
    camera = graph.run(
        str(graph.workspace / "lib/telepresence_1/com_cam.py"),
        *(f"--qi-url=tcp://127.0.0.1:{graph.robot_port}", "_source:=/dev/none", "_port:=0", "_show_on_tablet:=false"),
    )
    yield robot
    voice.end()
    camera.end()
    robot.close()


@pytest.fixture(scope="module")
def driver(running, robot, spoken, face, until_true):
    flags = (
        "--use-fake-ui-for-media-stream",
        "--use-fake-device-for-media-stream",
        f"--use-file-for-fake-audio-capture={spoken[1]}",
        f"--use-file-for-fake-video-capture={face}",
    )
    browser = Browser(running[1], SETTLED, flags)
    yield enter(browser, until_true)
    browser.tools.close()


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


def recorded(browser: Browser, seconds: float) -> np.ndarray:
    """What the page plays from now on."""
    return np.frombuffer(base64.b64decode(browser.evaluate(f"{RECORD}({seconds})")), "<i2") / 32768.0


class Likeness:
    """How well each piece of a sentence has come through so far; a machine that stands still spoils some of them."""

    def __init__(self, samples: np.ndarray) -> None:
        size = int(PIECE * RATE)
        pieces = [samples[at : at + size] for at in range(0, len(samples) - size + 1, size)]
        self._pieces = [piece for piece in pieces if np.sqrt(np.mean(piece**2)) > 0.02]
        self.best = [0.0] * len(self._pieces)

    def listen(self, heard: np.ndarray) -> bool:
        """Compare; whether all pieces have come through."""
        found = (match(piece, heard)[0] for piece in self._pieces)
        self.best = [max(pair) for pair in zip(self.best, found, strict=True)]
        return min(self.best) >= LIKENESS


@pytest.mark.alone
def test_the_pilot_s_voice_comes_out_of_the_robot_while_the_microphone_is_open(driver, robot, spoken, until_true):
    until_true(lambda: not driver.evaluate("document.getElementById('tool_microphone').hidden"), "one can speak")
    assert is_silent(robot) and not is_pressed(driver, "tool_microphone")
    press(driver, "tool_microphone")
    until_true(lambda: "Your voice comes out" in driver.text("section_sound"), "the robot gets the voice")
    likeness, period = Likeness(spoken[0]), len(spoken[0]) / RATE
    until_true(lambda: time.sleep(period / 2) or likeness.listen(played(robot, 2 * period)), lambda: likeness.best)
    print("likeness", [f"{value:.3f}" for value in likeness.best])
    press(driver, "tool_microphone")
    until_true(lambda: is_silent(robot), "the microphone is muted")
    driver.key("KeyV", True)
    until_true(lambda: not is_silent(robot), "the key talks while it is held")
    driver.key("KeyV", False)
    until_true(lambda: is_silent(robot), "and no longer")
    driver.key("KeyM", True)
    until_true(lambda: not is_silent(robot), "the other key opens it")
    hide(driver, True)
    until_true(lambda: is_silent(robot), "nobody speaks by a hidden page")
    hide(driver, False)
    assert not is_pressed(driver, "tool_microphone") and driver.errors == []


@pytest.mark.alone
def test_the_page_hears_what_is_said_beside_the_robot(driver, robot, until_true):
    until_true(lambda: is_pressed(driver, "tool_speaker"), "the page listens by itself")
    theirs = sentence(ROBOT_HEARS, "en-gb")
    likeness = Likeness(theirs)

    def heard() -> bool:
        robot.room.surroundings.play(theirs, RATE, time.monotonic() + 0.2)
        return likeness.listen(recorded(driver, len(theirs) / RATE + 1.5))

    until_true(heard, lambda: likeness.best)
    print("likeness", [f"{value:.3f}" for value in likeness.best])
    press(driver, "tool_speaker")
    until_true(lambda: not is_pressed(driver, "tool_speaker"), "the robot is muted")
    robot.room.surroundings.play(theirs, RATE)
    assert driver.evaluate("document.getElementById('robotSound').srcObject.getAudioTracks()[0].readyState") == "live"
    press(driver, "tool_speaker")
    until_true(lambda: is_pressed(driver, "tool_speaker"), "it is listened to again")


def test_the_face_is_on_the_robot_s_tablet_and_covered_while_the_page_is_hidden(driver, robot, until_true):
    def on_tablet() -> tuple[int, ...]:
        picture = robot.tablet.image.peek()
        return (0, 0, 0) if picture is None else tuple(map(int, picture.pixels[200, 320]))

    def shows_face() -> bool:
        return max(abs(a - b) for a, b in zip(on_tablet(), ORANGE, strict=True)) < 20

    until_true(lambda: not driver.evaluate("document.getElementById('tool_camera').hidden"), "one can be seen")
    assert not shows_face() and not is_pressed(driver, "tool_camera")
    press(driver, "tool_camera")
    until_true(shows_face, on_tablet)
    assert driver.evaluate("!document.getElementById('selfView').hidden"), "the pilot sees what they see"
    hide(driver, True)
    until_true(lambda: not shows_face(), "the camera is paused")
    hide(driver, False)
    until_true(shows_face, on_tablet)
    press(driver, "tool_camera")
    until_true(lambda: not shows_face(), "the camera is off")
    assert driver.errors == []


def test_the_robot_says_a_sentence(driver, graph, until_true):
    said = graph.probe()
    said.watch("/speech", "std_msgs/String", ["data"])
    until_true(lambda: not driver.evaluate("document.getElementById('tool_say').hidden"), "the robot can speak")
    press(driver, "tool_say")
    driver.tools.call("Input.insertText", text="May I come in?")
    driver.evaluate("document.getElementById('sayForm').requestSubmit()")
    until_true(lambda: said.newest("/speech") == ["May I come in?"], "it says so")
    until_true(lambda: driver.evaluate("document.getElementById('sentence').value") == "", "and the next one can come")
