"""One word for one thing: names that were given up stay given up, in every file but the changelog."""

from __future__ import annotations

import ast
import functools
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = [
    ROOT / name
    for name in subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    if (ROOT / name).is_file()
]
TEXT_FILES = [
    file
    for file in FILES
    if file.suffix not in (".png", ".json", ".urdf", ".csv") and file.name not in ("CHANGELOG.md", Path(__file__).name)
]
CODE = [file for file in TEXT_FILES if file.suffix == ".py" and file.relative_to(ROOT).parts[0] != "tests"]

GIVEN_UP = {
    "safety layer": "safety gate",
    "let the robot go": "reset the stop",
    "lets the robot go": "resets the stop",
    "let the bump go": "reset the bumper",
    "wanted is host": "expected host",
    "program of the sound": "sound program",
    "release the red stop": "reset the red stop",
    "release_red_stop": "reset_red_stop",
    "GuardedGate": "GatedDrive",
    "WirePeer": "naoqi.server",
    "WireClient": "naoqi.session",
    "RawServer": "naoqi.server",
    "RawClient": "naoqi.session",
    "drive_wire": "drive_datagram",
    "late_commands": "stale_command_filter",
    "LateCommands": "StaleCommandFilter",
    "door_watch": "naoqi.server",
    "port_probe": "naoqi.server",
    "PortProbe": "naoqi.server",
    "lettering": "draw_text",
    "pad_device": "joystick",
    "PadDevice": "Joystick",
    "pad_layouts": "joystick_layouts",
    "drive_hub": "input_mux",
    "DriveHub": "InputMux",
    "robot_mouth": "speaker_stream",
    "RobotMouth": "SpeakerStream",
    "robot_ears": "microphone_stream",
    "RobotEars": "MicrophoneStream",
    "WorldSurface": "WorldInterface",
    "VoiceSurface": "VoiceTopics",
    "picture_clock": "frame_timestamp",
    "CycleCollector": "GcOnQtThread",
}
"""Old name -> what it is called now."""

WORDS = {
    "guard": "gate",
    "guarded": "gated",
    "verdict": "gate",
    "seat": "robot_tab",
    "keeping": "capture",
    "door": "page_auth",
    "hub": "input_mux",
    "mouth": "speaker_stream",
    "surface": "ros_interface",
    "tell": "report",
    "tells": "reports",
    "hear": "receive",
    "hears": "receives",
    "wish": "request",
    "wishes": "requests",
    "mend": "fix",
    "persons": "people",
}
"""A word that no file, class, function, argument or variable of the code has in its name -> what it is called now."""
ALLOWED = {
    ("al_dialog.py", "tell"): "a method of NAOqi's",
    ("__main__.py", "tell"): "an option of the window's command line",
    ("range_sensors.py", "guard"): "typing.TypeGuard",
    ("replies.py", "guard"): "typing.TypeGuard",
    ("server.py", "hub"): "gevent's",
    ("mjpeg.py", "hub"): "gevent's",
}


@functools.cache
def _text(file: Path, lower: bool) -> str:
    text = file.read_text(errors="replace")
    return text.lower() if lower else text


def _names(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr


def _words(name: str) -> list[str]:
    """The words of a name in snake case or camel case, in lower case."""
    return [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]


@pytest.mark.parametrize("old", GIVEN_UP)
def test_a_name_that_was_given_up_is_nowhere(old):
    lower = " " in old
    found = [
        f"{file.relative_to(ROOT)}:{number}"
        for file in TEXT_FILES
        if old in _text(file, lower)  # the expression alone takes far longer
        for number, line in enumerate(_text(file, lower).splitlines(), 1)
        if re.search(rf"\b{re.escape(old)}\b", line)
    ]
    assert not found, f"it is called {GIVEN_UP[old]} now"


def test_no_name_in_the_code_has_a_word_that_was_given_up():
    found = {}
    for file in CODE:
        names = {file.stem, *_names(ast.parse(file.read_text()))}
        for name in names:
            for word in _words(name):
                if word in WORDS and (file.name, word) not in ALLOWED:
                    found[f"{file.relative_to(ROOT)}: {name}"] = f"say {WORDS[word]}"
    assert not found
