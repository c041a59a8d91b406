"""The keyboard program in an xterm, with keys that are held down on a virtual display."""

from __future__ import annotations

import subprocess

import pytest
from repeated_presses import press_until

from telepresence.station import processes
from telepresence.station.virtual_display import VirtualDisplay

pytestmark = [pytest.mark.ros, pytest.mark.x11]


@pytest.fixture
def keyboard(graph, wait_until):
    """xdotool for the keyboard of a display that shows nothing but the program."""
    display = VirtualDisplay(640, 400)
    environment = {**graph.environment, **display.environment}
    program = [str(graph.workspace / "lib/rto_teleop/rto_teleop_keyboard"), "__ns:=/rto3"]
    terminal = processes.start(["xterm", "-geometry", "100x28+0+0", "-e", *program], env=environment)

    def xdotool(*words: str) -> None:
        subprocess.run(["xdotool", *words], env=environment, check=True, timeout=30)

    xdotool("mousemove", "200", "200")  # without a window manager keys go to the window below the pointer
    yield xdotool
    family = processes.descendants(terminal.pid)
    processes.end(terminal, patience=5.0)
    wait_until(lambda: not {*family} & {*processes.descendants()}, "the program has ended with its terminal")
    display.close()


def test_two_held_keys_are_a_diagonal_and_each_ends_when_it_is_let_go(graph, keyboard, wait_until):
    probe = graph.probe()
    probe.watch("/rto3/cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"])
    wait_until(lambda: "/rto3/rto_teleop_keyboard" in probe.nodes(), "the program runs")

    def driven() -> list[list[float]]:
        return [velocity for _, velocity in probe.seen("/rto3/cmd_vel")]

    def drives(steps: list[str], velocity: list[float], what: str) -> None:
        """Press until this velocity stays for longer than a terminal's silence would let it. A program that was held
        up has let go of what was held: then all steps are made again."""

        def press() -> None:
            for step in steps:
                keyboard(*step.split())

        def release() -> None:
            keyboard("keyup", "w")
            keyboard("keyup", "a")

        press_until(press, release, wait_until, lambda: driven()[-8:] == [velocity] * 8, what)

    wait_until(lambda: keyboard("key", "w") or driven(), "keys reach the program")
    steps = ["keydown w"]
    drives(steps, [0.05, 0.0, 0.0], "W drives")
    steps += ["keydown a"]
    drives(steps, [0.05, 0.05, 0.0], "W and A drive")
    steps += ["keyup a"]
    drives(steps, [0.05, 0.0, 0.0], "W alone drives on, though the terminal repeats no key any more")
    keyboard("keyup", "w")
    wait_until(lambda: driven()[-1] == [0.0, 0.0, 0.0], "the robot stops")
