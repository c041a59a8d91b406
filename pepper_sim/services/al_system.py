"""ALSystem: name, version, time zone and RAM of the robot's computer."""

from __future__ import annotations

import os
import time
from pathlib import Path

from pepper_sim.naoqi.identity import ROBOT_NAME
from pepper_sim.naoqi.service import NAOQI_VERSION, Service, ServiceError, remote
from pepper_sim.services.al_memory import ALMemory

_MAX_NAME = 63
_ZONE_FILE = Path("/etc/timezone")


class ALSystem(Service):
    """Reports on the robot's computer."""

    name = "ALSystem"

    def __init__(self, memory: ALMemory) -> None:
        self._memory = memory
        self._robot_name = ROBOT_NAME
        memory.declare(("ALSystem/RobotNameChanged",), self.name)

    @remote("s()")
    def systemVersion(self) -> str:
        """Returns NAOqi's version."""
        return NAOQI_VERSION

    @remote("s()")
    def previousSystemVersion(self) -> str:
        """Returns the version before the last update; there was none."""
        return ""

    @remote("s()")
    def robotName(self) -> str:
        """Returns the robot's name."""
        return self._robot_name

    @remote("b(s)")
    def setRobotName(self, name: str) -> bool:
        """Names the robot; false for a name that is not a valid host name."""
        if not 0 < len(name) <= _MAX_NAME or not all(char.isalnum() or char in "-_" for char in name):
            return False
        self._robot_name = name
        self._memory.announce("ALSystem/RobotNameChanged", name)
        return True

    @remote("m()")
    def robotIcon(self) -> None:
        """Returns the robot's icon; it has none."""
        return None

    @remote("s()")
    def timezone(self) -> str:
        """Returns the time zone."""
        if _ZONE_FILE.is_file():
            return _ZONE_FILE.read_text().strip()
        return os.environ.get("TZ") or time.tzname[0]

    @remote("b(s)")
    def setTimezone(self, timezone: str) -> bool:
        """Sets the time zone. The machine's time zone is not changed: false."""
        return False

    @remote("i()")
    def freeMemory(self) -> int:
        """Returns the free RAM [kB]."""
        return _meminfo("MemAvailable")

    @remote("i()")
    def totalMemory(self) -> int:
        """Returns the total RAM [kB]."""
        return _meminfo("MemTotal")

    @remote("v()")
    def reboot(self) -> None:
        """Restarts the robot. Refused: a simulated robot is restarted where it was started."""
        raise ServiceError("a simulated robot cannot be rebooted from here")

    @remote("v()")
    def shutdown(self) -> None:
        """Switches the robot off. Refused: a simulated robot is ended where it was started."""
        raise ServiceError("a simulated robot cannot be shut down from here")


def _meminfo(field: str) -> int:
    """Read a line of /proc/meminfo [kB], limited to an int32."""
    for line in Path("/proc/meminfo").read_text().splitlines():
        if line.startswith(field + ":"):
            return min(int(line.split()[1]), 2**31 - 1)
    raise ServiceError(f"{field} is not known on this machine")
