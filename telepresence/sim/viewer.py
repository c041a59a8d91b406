"""MuJoCo's own viewer beside a running world."""

from __future__ import annotations

import os
import threading

from telepresence.sim.world import World

PERIOD = 1 / 30
"""Between two pictures [s]."""


_WINDOW_THREAD = "_launch_internal"
"""Part of the name of the thread that mujoco.viewer.launch_passive starts."""


class NoDisplay(RuntimeError):
    """There is no screen to open a window on."""


def require_display() -> None:
    """MuJoCo ends the whole process when it finds no display, so this is asked first.

    Raises: NoDisplay.
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
    import mujoco.viewer  # takes long to load, and only this function needs it

    shown = mujoco.MjData(world.model)
    with mujoco.viewer.launch_passive(world.model, shown) as window:
        with window.lock():
            window.opt.geomgroup[:] = 1  # by default the robots' group is hidden
        while window.is_running() and not stopping.wait(PERIOD):
            with window.lock(), world.locked() as data:
                mujoco.mj_copyData(shown, world.model, data)
            window.sync()
    # Leaving the block only asks the window's thread to end, and a process that exits before it has crashes.
    for thread in threading.enumerate():
        if _WINDOW_THREAD in thread.name:
            thread.join(timeout=5.0)
