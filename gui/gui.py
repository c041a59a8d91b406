"""The operator's window under another of its old names:  python3 gui/gui.py , or python3 gui.py in this folder."""

import runpy
import sys
from pathlib import Path

if __name__ == "__main__":
    program = Path(__file__).resolve().with_name("gui_main.py")
    # `python3 gui.py` puts this folder first, where this very file would be taken for the package `gui`.
    sys.path[0] = str(program.parent.parent)
    runpy.run_path(str(program), run_name="__main__")
