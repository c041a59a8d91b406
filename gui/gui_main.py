"""The operator's window, started the old way:  python3 gui_main.py  in this folder. See gui/__main__.py."""

import sys
from pathlib import Path

if __name__ == "__main__":
    # Python puts this folder first, where its files would hide modules of the same names.
    sys.path[0] = str(Path(__file__).resolve().parent.parent)
    from telepresence.environment import require

    require("PyQt5", "rospy")
    from gui.__main__ import main

    sys.exit(main())
