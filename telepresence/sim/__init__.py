"""MuJoCo simulation shared by every robot: the world, its clock, pictures, rays and the driven base.

Two defaults are set here because they must be in the environment before `mujoco` is imported:

* ``MUJOCO_GL=egl``: pictures are drawn without a display. A choice already made (``glfw``, ``osmesa``) is kept.
* ``LP_NUM_THREADS=1``: Mesa's software renderer would otherwise take the cores that physics and ROS nodes need, for
  the same CPU time per picture.
"""

import os

os.environ.setdefault("MUJOCO_GL", "egl")
os.environ.setdefault("LP_NUM_THREADS", "1")
