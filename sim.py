#!/usr/bin/env python3
"""The first terminal of the simulation guide:  python3 sim.py --terrain flat.  See `sim_bringup.one_terminal`."""

import sys

from telepresence.environment import require

if __name__ == "__main__":
    require("mujoco", "rospy", "sim_bringup")
    from sim_bringup.one_terminal import main

    sys.exit(main())
