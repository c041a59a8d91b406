"""The command lines of the guides that start something in gui/: with the system's Python, in a shell that has not read
env.sh, from where the guides stand."""

import os
import subprocess

import pytest
from window_station import ROOT

WINDOW = "The operator's window."
TABLET = "tablet"


@pytest.mark.parametrize(
    ("folder", "line", "expected"),
    [
        (".", "python3 gui/gui.py --help", WINDOW),
        ("gui", "python3 gui.py --help", WINDOW),
        ("gui", "python3 gui_main.py --help", WINDOW),
        ("gui", "python3 main.py --qi-url 127.0.0.1 --help", TABLET),
        ("/", f"python3 {ROOT}/gui/main.py --help", TABLET),
    ],
)
def test_what_the_guides_type_is_there(folder, line, expected):
    environment = {"HOME": os.environ.get("HOME", "/"), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(line.split(), cwd=ROOT / folder, env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert expected in done.stdout
