"""Which services a simulated Pepper has, and what each needs."""

from __future__ import annotations

import contextlib
from typing import Any

import qi

from pepper_sim.robot import Pepper
from pepper_sim.services.body_events import BodyEvents
from pepper_sim.services.client_services import ClientServices
from pepper_sim.services.memory import ALMemory
from pepper_sim.services.memory_keys import body_keys
from pepper_sim.services.motion import ALMotion
from pepper_sim.services.robot_posture import ALRobotPosture
from pepper_sim.services.service import Service
from pepper_sim.services.tasks import Workers
from pepper_sim.services.video_device import ALVideoDevice
from pepper_sim.tablet import Tablet


class Catalogue:
    """Builds all services of one robot, in `services`, and ends them."""

    def __init__(self, robot: Pepper, session: qi.Session, tablet: Tablet | None) -> None:
        self._workers = Workers()
        self._clients = ClientServices(session)
        self.memory = ALMemory(robot.snapshot, body_keys(robot.JOINTS), self._clients)
        self.motion = ALMotion(robot, self.memory, self._workers)
        self.video = ALVideoDevice(robot)
        posture = ALRobotPosture(robot, self.memory, self._workers, self.motion.joints)
        self.services: list[Service] = [self.memory, self.motion, posture, self.video]
        self._events = BodyEvents(robot, self.memory)

    def close(self) -> None:
        """End threads, newest first."""
        with contextlib.ExitStack() as stack:
            closing: list[Any] = [self._clients, self._workers, *self.services, self._events]
            for part in closing:
                stack.callback(part.close)
