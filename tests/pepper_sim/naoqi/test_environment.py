"""libqi reads its environment once, when it is loaded: by then `pepper_sim.naoqi` must have set it."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import importlib.abc, os, sys

class BeforeQi(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "qi":
            print(os.environ.get("QI_LOG_LEVEL"), os.environ.get("QI_MAX_MESSAGE_PAYLOAD"))

sys.meta_path.insert(0, BeforeQi())
__import__(sys.argv[1])
"""


@pytest.mark.parametrize("module", ["pepper_sim.server", "pepper_sim.services.al_memory", "pepper_sim.naoqi.publish"])
def test_the_environment_is_set_before_qi_is_loaded(module):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("QI_")}
    run = [sys.executable, "-c", SCRIPT, module]
    done = subprocess.run(run, env=environment, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == ["1", str(32 * 1024 * 1024)]
