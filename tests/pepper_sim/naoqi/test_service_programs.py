"""The environment of programs on the robot, which `import qi` whoever made it."""

import importlib.util
import os
import subprocess
import sys

from pepper_sim.naoqi.service_programs import environment

SCRIPT = """
import os, qi
session = qi.Session()
try:
    session.connect(os.environ["QI_URL"])
except RuntimeError as error:
    print(qi.__name__, "refused" in str(error))
"""


def test_programs_have_ours_where_the_vendors_is_not_installed(monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "qi" else find(name))
    monkeypatch.setenv("PYTHONPATH", os.environ.get("PYTHONPATH", ""))
    run = [sys.executable, "-c", SCRIPT]
    done = subprocess.run(run, env=environment("tcp://127.0.0.1:1"), capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == ["telepresence.naoqi", "True"], done.stderr


def test_programs_have_the_vendors_where_it_is(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    monkeypatch.setenv("PYTHONPATH", "somewhere")
    found = environment("tcp://127.0.0.1:9559")
    assert (found["QI_URL"], found["PYTHONPATH"]) == ("tcp://127.0.0.1:9559", "somewhere")
