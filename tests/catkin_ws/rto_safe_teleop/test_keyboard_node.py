"""The keyboard program in a terminal of its own, on a private graph."""

from __future__ import annotations

import os
import select
import signal

import pytest

from telepresence.station import processes

pytestmark = pytest.mark.ros


class Terminal:
    """A pseudo-terminal with the program in it."""

    def __init__(self, graph) -> None:
        self._keys, slave = os.openpty()
        self.process = processes.start(
            [str(graph.workspace / "lib/rto_safe_teleop/safe_keyboard_teleop"), "__ns:=/rto3"],
            env=graph.environment,
            stdin=slave,
            stdout=slave,
            stderr=slave,
        )
        os.close(slave)

    def type(self, keys: str) -> None:
        os.write(self._keys, keys.encode())

    def wait_for(self, text: str) -> None:
        shown = ""
        while text not in shown:
            shown += os.read(self._keys, 4096).decode(errors="replace")

    def hold(self, key: str, until: str) -> None:
        """Hold a key, as a terminal repeats it, until the program prints this."""
        shown = ""
        while until not in shown:
            self.type(key)
            if select.select([self._keys], [], [], 0.05)[0]:
                shown += os.read(self._keys, 4096).decode(errors="replace")

    def close(self) -> None:
        processes.end(self.process, patience=5.0)
        os.close(self._keys)


@pytest.fixture(scope="module")
def probe(graph):
    probe = graph.probe()
    probe.watch("/rto3/safe_cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"])
    return probe


@pytest.fixture
def terminal(graph, probe, until_true):
    made = Terminal(graph)
    made.wait_for("0.050 m/s")
    until_true(lambda: "/rto3/safe_cmd_vel" in probe.topics(), "the program is on the graph")
    probe.forget("/rto3/safe_cmd_vel")
    yield made
    made.close()


def seen(probe):
    return [fields for _, fields in probe.seen("/rto3/safe_cmd_vel")]


def press_until(terminal, key, probe, wanted, until_true):
    """Hold a key, as a terminal repeats it."""
    until_true(lambda: terminal.type(key) or wanted in seen(probe), f"{key!r} gives {wanted}")


def test_held_key_drives_and_stops_when_let_go(terminal, probe, until_true):
    press_until(terminal, "w", probe, [0.05, 0.0, 0.0], until_true)
    until_true(lambda: seen(probe)[-1] == [0.0, 0.0, 0.0], "zeros follow")
    press_until(terminal, "q", probe, [0.0, 0.0, 0.5], until_true)
    until_true(lambda: seen(probe)[-1] == [0.0, 0.0, 0.0], "zeros follow again")


def test_keys_do_nothing_while_nobody_may_drive(terminal, graph, probe, until_true):
    press_until(terminal, "w", probe, [0.05, 0.0, 0.0], until_true)
    hold = graph.run("rostopic", "pub", "-l", "/rto3/drive/hold", "std_msgs/String", "anna has pressed the red stop.")
    terminal.hold("w", "The robot stays: anna has pressed the red stop.")
    until_true(lambda: seen(probe)[-1] == [0.0, 0.0, 0.0], "the robot stops")
    hold.end()
    press_until(terminal, "s", probe, [-0.05, 0.0, 0.0], until_true)


def test_last_word_is_a_zero(terminal, probe, until_true):
    press_until(terminal, "a", probe, [0.0, 0.05, 0.0], until_true)
    terminal.type("a")
    terminal.process.send_signal(signal.SIGINT)
    assert terminal.process.wait(10.0) == 0
    until_true(lambda: seen(probe)[-1] == [0.0, 0.0, 0.0], "the last velocity is zero")
