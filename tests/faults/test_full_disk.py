"""A full disk is said, and what was written before stays whole."""

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path


def test_a_full_disk_is_said_and_the_old_files_stay_whole(tmp_path):
    """On a disk of its own, in a mount namespace that ends with the program."""
    words = [sys.executable, str(Path(__file__).with_name("full_disk.py")), str(tmp_path)]
    script = f"mount -t tmpfs -o size=512k tmpfs {shlex.quote(str(tmp_path))} && exec {shlex.join(words)}"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = ["unshare", "-rm", "sh", "-c", script]
    answer = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert answer.returncode == 0, answer.stderr
    found = json.loads(answer.stdout)
    assert found["report"] == "old" and found["accounts"] and "robot=old" in found["settings"]
    assert found["settings later"], "what the full disk refused is written with the next change"
    assert found["left"] == [], "no half of a new file stays"
    assert all("No space left" in text or "full" in text for text in found["messages"].values()), found["messages"]
