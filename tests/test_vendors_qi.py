"""Tests that need the vendor's library: on a machine without it they are left out, and the summary names them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

LAB = Path(__file__).parent / "lab"
ARM64 = "import platform; platform.machine = lambda: 'aarch64'"
WHOLE_FILE = "import qi\n\ndef test_of_the_vendors_alone(): pass\n"
PARTS = """
import pytest

PROGRAM = '''
import qi
'''

@pytest.mark.parametrize("client", ["ours", pytest.param("vendors", marks=pytest.mark.vendor)])
def test_of_both(client):
    assert client == "ours"
"""


def test_no_program_needs_it():
    folders = ("gui", "telepresence", "pepper_sim", "robotino_sim", "catkin_ws/src")
    programs = [path for folder in folders for path in (LAB.parents[1] / folder).rglob("*.py")]
    needs = re.compile(r"""^\s*(import|from) qi\b|require\([^)]*["']qi["']""", re.MULTILINE)
    assert len(programs) > 300 and [path for path in programs if needs.search(path.read_text())] == []


@pytest.mark.parametrize("workers", [[], ["-n", "2"]], ids=["alone", "by workers"])
def test_on_arm64_the_summary_names_what_is_left_out(tmp_path: Path, workers: list[str]):
    for name, text in {"arm64.py": ARM64, "test_whole.py": WHOLE_FILE, "test_parts.py": PARTS}.items():
        (tmp_path / name).write_text(text)
    command = [sys.executable, "-m", "pytest", "-p", "arm64", "-p", "vendors_qi", "-p", "no:cacheprovider", *workers]
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}:{LAB}"}
    answer = subprocess.run([*command, tmp_path], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stdout
    assert "1 passed" in answer.stdout
    assert "need the vendor's qi (x86_64, Python up to 3.12), and this is aarch64, Python" in answer.stdout
    assert "test_parts.py: 1 of its tests" in answer.stdout and "test_whole.py: the whole file" in answer.stdout
