"""A robot that is a tablet and nothing else."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.publish import served_object
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.services.al_tablet_service import ALTabletService
from pepper_sim.tablet.tablet import Tablet


@contextlib.contextmanager
def tablet_robot(naoqi: Any) -> Iterator[Tablet]:
    """Register ALTabletService with a NAOqi of the tests; give its tablet."""
    with Tablet() as tablet, contextlib.closing(RobotDisk()) as disk, contextlib.closing(Alarm()) as alarm:
        naoqi.register("ALTabletService", served_object(ALTabletService(tablet, disk, alarm)))
        yield tablet
