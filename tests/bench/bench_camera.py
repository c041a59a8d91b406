"""Pictures at 640x480 through NAOqi's wire against the bare MuJoCo renderer on the same model.

The robot turns: what a camera sees is painted only when something in it has moved.
"""

from __future__ import annotations

import time

import mujoco
from media.camera_client import start_viewers
from report import Row, percentile

from pepper_sim.models import pepper_model
from pepper_sim.simulation import Simulation
from telepresence.sim.scene import build_world

SECONDS = 10.0
BARE_PICTURES = 150
TURN = 0.5
"""[rad/s]"""


def run() -> list[Row]:
    bare = bare_renderer(build_world("apartment", [pepper_model()]).model)
    with Simulation(port=0) as simulation:
        simulation.robot.set_velocity(0.0, 0.0, TURN)
        idle = cpu_share()
        with start_viewers(simulation.url, cameras=(0,)) as viewers:
            viewers.wait_for_first_pictures()
            pictures = viewers.viewers[0].pictures
            first, begin = len(pictures), time.monotonic()
            busy = cpu_share()
            wall = time.monotonic() - begin
            taken = pictures[first:]
    ages = [arrival - stamp for arrival, stamp in taken]
    stamps = {stamp for _, stamp in taken}
    rate = len(taken) / wall
    cost = (busy - idle) / rate
    return [
        Row("pictures/s delivered", rate, 30.0, "1/s", "asked for"),
        Row("pictures/s with a stamp of their own", len(stamps) / wall, 30.0, "1/s", "asked for"),
        Row("age at arrival, p50", percentile(ages, 50) * 1e3, 1000 / 30, "ms", "one period"),
        Row("age at arrival, p99", percentile(ages, 99) * 1e3, 1000 / 30, "ms", "one period"),
        Row("processor per picture", cost * 1e3, bare * 1e3, "ms", "bare renderer"),
        Row("pictures per processor second", 1 / cost, 1 / bare, "1/s", "bare renderer"),
    ]


def cpu_share() -> float:
    """Cores that this process uses over the next seconds."""
    cpu, wall = time.process_time(), time.monotonic()
    time.sleep(SECONDS)
    return (time.process_time() - cpu) / (time.monotonic() - wall)


def bare_renderer(model: mujoco.MjModel) -> float:
    """Processor seconds per picture of the same camera, with all threads that OpenGL starts."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = next(name for name in (model.camera(i).name for i in range(model.ncam)) if name.endswith("CameraTop"))
    with mujoco.Renderer(model, 480, 640) as renderer:
        for count in range(BARE_PICTURES + 10):
            if count == 10:
                begin = time.process_time()
            renderer.update_scene(data, camera)
            renderer.render()
        return (time.process_time() - begin) / BARE_PICTURES
