"""ALSystem: name, version, time zone, RAM and disk of the robot's computer. Source: NAOqi 2.8 documentation."""

from __future__ import annotations

import os
import shutil
import time
import zoneinfo
from pathlib import Path

import cv2
import numpy as np

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.identity import ROBOT_NAME
from pepper_sim.naoqi.service import NAOQI_VERSION, Module, ServiceError, remote
from pepper_sim.services.al_memory import ALMemory

_MAX_NAME = 63
_ZONE_FILE = Path("/etc/timezone")
_PARTITION = "(ssLL)<PartitionInfo,filesystem,path,size,free>"


class ALSystem(Module):
    """Reports on the robot's computer."""

    name = "ALSystem"

    def __init__(self, memory: ALMemory, disk: RobotDisk) -> None:
        self._memory = memory
        self._disk = disk
        self._timezone = ""
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
    def robotIcon(self) -> bytes:
        """Returns the robot's icon, a picture of its head, as PNG."""
        return _icon()

    @remote("s()")
    def timezone(self) -> str:
        """Returns the time zone."""
        if self._timezone:
            return self._timezone
        if _ZONE_FILE.is_file():
            return _ZONE_FILE.read_text().strip()
        return os.environ.get("TZ") or time.tzname[0]

    @remote("b(s)")
    def setTimezone(self, timezone: str) -> bool:
        """Sets the robot's time zone, not that of the machine that simulates it; false if it is unknown."""
        if timezone not in zoneinfo.available_timezones():
            return False
        self._timezone = timezone
        return True

    @remote("i()")
    def freeMemory(self) -> int:
        """Returns the free RAM [kB]."""
        return _meminfo("MemAvailable")

    @remote("i()")
    def totalMemory(self) -> int:
        """Returns the total RAM [kB]."""
        return _meminfo("MemTotal")

    @remote(f"[{_PARTITION}](b)")
    def diskFree(self, all: bool) -> list[tuple]:
        """Describes the disk for user data: [(file system, path, size [bytes], free [bytes])]."""
        usage = shutil.disk_usage(self._disk.root)
        return [("simulated", "/home", usage.total, usage.free)]

    @remote("v(ss)")
    def changePassword(self, old: str, new: str) -> None:
        """Changes the password of the robot's computer. Refused: a simulated robot has no accounts."""
        raise ServiceError("a simulated robot has no accounts")

    @remote("b(ss)")
    def upgrade(self, image: str, checksum: str) -> bool:
        """Installs a system image. Refused: a simulated robot runs none."""
        raise ServiceError("a simulated robot runs no system image")

    @remote("b(ss)")
    def factoryReset(self, image: str, checksum: str) -> bool:
        """Installs a system image and deletes the user's data. Refused: a simulated robot runs none."""
        raise ServiceError("a simulated robot runs no system image")

    @remote("v()")
    def reboot(self) -> None:
        """Restarts the robot. Refused: a simulated robot is restarted where it was started."""
        raise ServiceError("a simulated robot cannot be rebooted from here")

    @remote("v()")
    def shutdown(self) -> None:
        """Switches the robot off. Refused: a simulated robot is ended where it was started."""
        raise ServiceError("a simulated robot cannot be shut down from here")


def _icon() -> bytes:
    """Return a white head with two blue eyes on a clear ground."""
    size = 128
    picture = np.zeros((size, size, 4), np.uint8)
    cv2.circle(picture, (size // 2, size // 2), 58, (245, 245, 245, 255), -1, cv2.LINE_AA)
    for x in (40, 88):
        cv2.circle(picture, (x, 60), 13, (230, 150, 40, 255), -1, cv2.LINE_AA)
        cv2.circle(picture, (x, 60), 6, (40, 30, 20, 255), -1, cv2.LINE_AA)
    return cv2.imencode(".png", picture)[1].tobytes()


def _meminfo(field: str) -> int:
    """Read a line of /proc/meminfo [kB], limited to an int32."""
    for line in Path("/proc/meminfo").read_text().splitlines():
        if line.startswith(field + ":"):
            return min(int(line.split()[1]), 2**31 - 1)
    raise ServiceError(f"{field} is not known on this machine")
