"""A display without a screen, and its picture."""

import os
import subprocess

import pytest

from telepresence.station.virtual_display import VirtualDisplay, display_answers, grab

pytestmark = pytest.mark.x11


@pytest.fixture
def display():
    display = VirtualDisplay(400, 300)
    yield display
    display.close()


def test_shows_what_is_drawn(display, run_program, wait_until):
    assert grab(display.folder).shape == (300, 400, 3)
    run_program(
        "xterm",
        "-fa",
        "DejaVu Sans Mono",
        "-bg",
        "#ff8000",
        "-geometry",
        "200x100+0+0",
        stderr=subprocess.DEVNULL,
        env={**os.environ, **display.environment},
    )
    wait_until(
        lambda: grab(display.folder)[40, 300].tolist() == [0, 128, 255], "the orange of the window, as BGR, is there"
    )


def test_answers_until_closed(display):
    assert display_answers(display.name)
    display.close()
    assert not display_answers(display.name)
    assert not display.folder.exists()


@pytest.mark.parametrize("name", [None, "", "nonsense", ":", ":x", ":54321"])
def test_a_display_that_is_not_there_does_not_answer(name):
    assert not display_answers(name)
