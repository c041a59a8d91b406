"""Shows a page on Pepper's tablet, started the old way:  python main.py --qi-url IP  in this folder.

The program is telepresence_1's main.py, and `rosrun telepresence_1 main.py` is the same. Any python3 will do: one
without the project's packages restarts itself in the project's environment.
"""

import os
import runpy
import sys
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "catkin_ws" / "src" / "telepresence_1" / "nodes" / "main.py"


def start() -> None:
    if any(find_spec(name) is None for name in ("qi", "naoqi_driver", "telepresence_1", "telepresence")):
        if os.environ.pop("TELEPRESENCE_RESTARTED", ""):
            sys.exit("main.py: the project's packages are not installed. Install them with:  ./stack build")
        os.environ["TELEPRESENCE_RESTARTED"] = "1"
        stack = str(ROOT / "stack")
        os.execv(stack, [stack, "exec", "python", os.path.abspath(__file__), *sys.argv[1:]])
    # Python puts this folder first, where its files would hide modules of the same names.
    sys.path[0] = str(PROGRAM.parent)
    runpy.run_path(str(PROGRAM), run_name="__main__")


if __name__ == "__main__":
    start()
