"""The operator's window, started the old way:  python3 gui_main.py  in this folder. See gui/__main__.py.

Any python3 will do: one without the project's packages restarts itself in the project's environment.
"""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def start() -> int:
    if find_spec("PyQt5") is None or find_spec("rospy") is None:
        if os.environ.pop("TELEPRESENCE_RESTARTED", ""):
            print("gui: PyQt5 and rospy are not installed. Install them with:  ./stack build", file=sys.stderr)
            return 1
        os.environ["TELEPRESENCE_RESTARTED"] = "1"
        stack = str(ROOT / "stack")
        os.execv(stack, [stack, "exec", "python", os.path.abspath(__file__), *sys.argv[1:]])
    # Python puts this folder first, where its files would hide modules of the same names.
    sys.path[0] = str(ROOT)
    from gui.__main__ import main

    return main()


if __name__ == "__main__":
    sys.exit(start())
