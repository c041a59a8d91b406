"""Shows a page on Pepper's tablet, started the old way:  python main.py --qi-url IP  in this folder.

The program is telepresence_1's main.py, and `rosrun telepresence_1 main.py` is the same.
"""

import runpy
import sys
from pathlib import Path

if __name__ == "__main__":
    # Python puts this folder first, where its files would hide modules of the same names.
    sys.path[0] = str(Path(__file__).resolve().parent.parent)
    from telepresence.environment import ROOT, require

    require("rospy", "naoqi_driver", "telepresence_1")
    program = ROOT / "catkin_ws" / "src" / "telepresence_1" / "nodes" / "main.py"
    runpy.run_path(str(program), run_name="__main__")
