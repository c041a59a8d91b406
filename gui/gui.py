"""The window of the simulation guide:  python3 gui/gui.py , or python3 gui.py in this folder.

It shows the guide's robot, the walker, unless `--profile` names another; else it is the window of gui_main.py.
"""

import runpy
import sys
from pathlib import Path

if __name__ == "__main__":
    program = Path(__file__).resolve().with_name("gui_main.py")
    # `python3 gui.py` puts this folder first, where this very file would be taken for the package `gui`.
    sys.path[0] = str(program.parent.parent)
    if not any(word.startswith("--profile") for word in sys.argv[1:]):
        sys.argv[1:1] = ["--profile", "walker"]
    runpy.run_path(str(program), run_name="__main__")
