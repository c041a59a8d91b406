"""The examples of docs/naoqi.md run as they stand there, but for the robot's address."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from typing import Any

import telepresence.naoqi

PAGE = Path(__file__).resolve().parents[2] / "docs" / "naoqi.md"
ADDRESS = "tcp://192.168.1.20:9559"


def _example(heading: str) -> str:
    section = PAGE.read_text().partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    return re.search(r"```python\n(.*?)```", section, re.DOTALL)[1]


def _run(heading: str, address: str, **names: Any) -> dict[str, Any]:
    program = _example(heading)
    assert ADDRESS in program
    exec(compile(program.replace(ADDRESS, address), PAGE.name, "exec"), names)
    return names


def test_ten_lines_read_the_battery_and_answer_a_touch(naoqi, wait_until, capsys):
    memory = naoqi.ALMemory
    said = threading.Event()
    sentences: list[str] = []
    subscriber = memory.subscriber("ALTextToSpeech/CurrentSentence")
    subscriber.signal.connect(sentences.append)

    def touch(_prompt: str) -> None:
        memory.raiseEvent("FrontTactilTouched", 1.0)
        wait_until(lambda: "Hello." in sentences, "the robot speaks")
        said.set()

    assert len(_example("Ten lines").strip().splitlines()) <= 10
    _run("Ten lines", naoqi.simulation.url, input=touch)
    assert said.is_set()
    assert re.fullmatch(r"battery: (0\.\d+|1\.0)\n", capsys.readouterr().out)


def test_a_program_serves_an_object_to_the_robot_and_to_others(naoqi, wait_until):
    names = _run("Serving objects", naoqi.simulation.url)
    other = telepresence.naoqi.Session()
    other.connect(naoqi.simulation.url)
    try:
        greeter, seen = other.service("Greeter"), []
        greeter.greeted.connect(seen.append)
        assert greeter.greet("world") == "Hello, world."
        wait_until(lambda: seen == ["world"], "the signal")
    finally:
        other.close()
        names["session"].close()
