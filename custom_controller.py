#!/usr/bin/env python3
"""The controller of the simulation guide:  python3 custom_controller.py.  Edit it among the examples of sim_bringup."""

import runpy

from telepresence.environment import ROOT, require

if __name__ == "__main__":
    require("rospy", "sim_bringup")
    example = ROOT / "catkin_ws" / "src" / "sim_bringup" / "examples" / "custom_controller.py"
    runpy.run_path(str(example), run_name="__main__")
