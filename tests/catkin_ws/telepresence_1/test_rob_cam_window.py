"""The report's window with what the robot sees, on a real X server."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator

import pytest
from one_colour_camera import publish_colour

from telepresence.station.virtual_display import VirtualDisplay, grab

pytestmark = [pytest.mark.ros, pytest.mark.x11]

ORANGE = (230, 130, 20)


@pytest.fixture
def display() -> Iterator[VirtualDisplay]:
    display = VirtualDisplay()
    yield display
    display.close()


def test_it_shows_the_robots_picture_and_greys_an_old_one(
    graph, monkeypatch: pytest.MonkeyPatch, display: VirtualDisplay, wait_until: Callable
) -> None:
    for name, value in display.environment.items():
        monkeypatch.setitem(graph.environment, name, value)
    node = graph.run(str(graph.workspace / "lib" / "telepresence_1" / "rob_cam.py"), "_image:=/camera")
    robot = publish_colour(graph, "/camera", ORANGE)

    def shown() -> bool:
        screen = grab(display.folder)[:, :, ::-1].astype(int)
        return (abs(screen - ORANGE).max(axis=2) < 15).mean() > 0.3

    wait_until(shown, "the picture fills the window")
    robot.kill()
    wait_until(lambda: not shown(), "an old picture is greyed")
    node.signal(signal.SIGINT)
    assert node.process.wait(30) == 0
