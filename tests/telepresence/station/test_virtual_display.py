"""A display without a screen, and its picture."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from telepresence.station import absence
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


def test_it_says_why_there_is_no_display(display):
    running = display.process
    try:
        with pytest.raises(RuntimeError, match=r"could not open a display: .*already (active|running)"):
            display.start_again()
    finally:
        display.process.wait(10.0)
        display.process = running


@pytest.mark.parametrize("name", [None, "", "nonsense", ":", ":x", ":54321"])
def test_a_display_that_is_not_there_does_not_answer(name):
    assert not display_answers(name)


def test_a_display_whose_owner_has_died_is_taken_over(tmp_path, monkeypatch, wait_until):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setenv(absence.VARIABLE, "1")
    code = (
        "import os; from telepresence.station.virtual_display import VirtualDisplay; "
        "display = VirtualDisplay(400, 300); print(display.folder, display.process.pid, flush=True); os.abort()"
    )
    said = tmp_path / "said"  # no pipe: the display would keep it open
    with said.open("w") as output:
        subprocess.run([sys.executable, "-c", code], stdout=output, check=False)
    folder, pid = said.read_text().split()
    display = VirtualDisplay(400, 300, left=Path(folder))
    try:
        assert display.process.pid == int(pid) and display_answers(display.name)
        display.process.kill()
        wait_until(lambda: display.process.poll() is not None, "it has ended")
        display.start_again()
        assert display.process.pid != int(pid) and display_answers(display.name)
    finally:
        display.close()
    assert not display_answers(display.name) and not Path(folder).exists()
