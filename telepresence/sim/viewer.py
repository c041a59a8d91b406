"""MuJoCo's own viewer for a running world."""

from __future__ import annotations

import math
import os
import threading

import mujoco
import numpy as np

from telepresence.sim.world import World

PERIOD = 1 / 30
"""Between two pictures [s]."""
DRAWING = PERIOD / 10
"""The part of it in which MuJoCo may begin to draw [s]."""


_WINDOW_THREAD = "_launch_internal"
"""Part of the name of the thread that mujoco.viewer.launch_passive starts."""


class NoDisplay(RuntimeError):
    """There is no screen to open a window on."""


def require_display() -> None:
    """Check that there is a display, because MuJoCo ends the whole process without one.

    Raises:
        NoDisplay: There is no screen.
    """
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise NoDisplay("the viewer needs a display, and neither DISPLAY nor WAYLAND_DISPLAY is set")


def view(world: World, stopping: threading.Event) -> None:
    """Show the world until the window is closed or `stopping` is set; the simulation goes on without it.

    The viewer gets a copy of the state, so that opening its window and drawing never hold the physics up.

    Raises:
        NoDisplay: There is no screen.
    """
    require_display()
    from mujoco import viewer  # takes long to load, and only this function needs it

    shown = mujoco.MjData(world.model)
    panels = {"show_left_ui": False, "show_right_ui": False}
    with viewer.launch_passive(world.model, shown, **panels) as window:
        with window.lock():
            window.opt.geomgroup[:] = 1  # by default the robots' group is hidden
            _look_over(world.model, window.cam)
        while window.is_running() and not stopping.wait(DRAWING):
            # MuJoCo draws as often as it gets the lock: on a screen without vertical sync, with a whole processor.
            with window.lock():
                with world.locked() as data:
                    mujoco.mj_copyData(shown, world.model, data)
                window.sync()
                stopping.wait(PERIOD - DRAWING)
    # Leaving the block only asks the window's thread to end, and a process that exits before it has crashes.
    for thread in threading.enumerate():
        if _WINDOW_THREAD in thread.name:
            thread.join(timeout=5.0)


def _look_over(model: mujoco.MjModel, camera: mujoco.MjvCamera) -> None:
    """Place the viewer where the scene's camera `overview` is; the mouse then orbits what that looks at."""
    overview = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, "overview")
    if overview < 0:
        return
    position, backward = model.cam_pos0[overview], model.cam_mat0[overview].reshape(3, 3)[:, 2]
    camera.distance = position[2] / backward[2] if backward[2] > 0.1 else float(np.linalg.norm(position))
    camera.lookat[:] = position - camera.distance * backward
    camera.azimuth = math.degrees(math.atan2(-backward[1], -backward[0]))
    camera.elevation = math.degrees(math.asin(-backward[2]))
