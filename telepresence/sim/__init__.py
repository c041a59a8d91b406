"""MuJoCo simulation shared by every robot: the world, its clock, pictures, rays and the driven base.

Two defaults are set here because they must be in the environment before `mujoco` is imported:

* ``MUJOCO_GL=egl``: pictures are drawn without a display. A choice already made (``glfw``, ``osmesa``) is kept.
* ``LP_NUM_THREADS=0``: Mesa's software renderer paints on the thread that asks for a picture. It would otherwise take
  the cores that physics and ROS nodes need; and handing over to even one thread of its own costs 5 % more processor.
"""

import os

os.environ.setdefault("MUJOCO_GL", "egl")
os.environ.setdefault("LP_NUM_THREADS", "0")
