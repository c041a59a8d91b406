"""Reads what changes seldom: bumpers, touch, battery, temperatures, and what the robot is.

Wire: one `ALMemory.getListData`. The keys are polled because NAOqi 2.5 did not deliver events to newer clients of the
vendor's (ros-naoqi/libqi-python, issue 13), and on no such robot was it tried whether ours gets them. Keys: NAOqi 2.8
documentation, pepper_dcm/actuator_sensor_names; those of the robot's parts: naoqi_driver (ros-naoqi), its topic info.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from naoqi_driver.replies import as_number, sequence
from telepresence.security.outside_text import clean

_DEVICE = "Device/SubDeviceList"
SWITCHES: Mapping[str, str] = {
    "bumper/right": f"{_DEVICE}/Platform/FrontRight/Bumper/Sensor/Value",
    "bumper/left": f"{_DEVICE}/Platform/FrontLeft/Bumper/Sensor/Value",
    "bumper/back": f"{_DEVICE}/Platform/Back/Bumper/Sensor/Value",
    "head/front": f"{_DEVICE}/Head/Touch/Front/Sensor/Value",
    "head/middle": f"{_DEVICE}/Head/Touch/Middle/Sensor/Value",
    "head/rear": f"{_DEVICE}/Head/Touch/Rear/Sensor/Value",
    "hand/right": f"{_DEVICE}/RHand/Touch/Back/Sensor/Value",
    "hand/left": f"{_DEVICE}/LHand/Touch/Back/Sensor/Value",
}
"""What can be pressed -> its key."""
BATTERY_KEYS = (
    f"{_DEVICE}/Battery/Charge/Sensor/Value",
    f"{_DEVICE}/Battery/Current/Sensor/Value",
    "BatteryPowerPluggedChanged",
)
_BODY = "RobotConfig/Body"
INFO_KEYS = (
    "RobotConfig/Head/FullHeadId",
    "Device/DeviceList/ChestBoard/BodyId",
    f"{_BODY}/Type",
    f"{_BODY}/BaseVersion",
    f"{_BODY}/Device/LeftArm/Version",
    f"{_BODY}/Device/RightArm/Version",
    f"{_BODY}/Device/Hand/Left/Version",
    f"{_BODY}/Version",
    f"{_BODY}/SoftwareRequirement",
    f"{_BODY}/Device/Legs/Version",
    "Device/DeviceList/BatteryFuelGauge/SerialNumber",
    "Device/DeviceList/BatteryFuelGauge/FirmwareVersion",
    f"{_BODY}/Device/Platform/Version",
    f"{_BODY}/Device/Brakes/Version",
    f"{_BODY}/Device/Wheel/Version",
)
"""Which robot it is and what it is made of, in the order of naoqi_driver's topic info."""
HOT = 1
"""Temperature status from which a joint is too warm: 1 limit reached, 2 weakened, 3 off."""


@dataclass(frozen=True)
class Battery:
    """Charge 0 to 1 and current [A], negative while it is drained; NaN and None where the robot does not report it."""

    charge: float
    current: float
    plugged: bool | None


@dataclass(frozen=True)
class Temperatures:
    """Temperatures of the joints [°C], and their status, 0 for normal."""

    celsius: dict[str, float]
    status: dict[str, int]

    @property
    def hot(self) -> list[str]:
        return [joint for joint, status in self.status.items() if status >= HOT]


def read_switches(values: Any) -> dict[str, bool]:
    """Which of `SWITCHES` are pressed; one that the robot does not have is left out.

    Args:
        values: What getListData answered for the keys of `SWITCHES`, in their order.
    Raises:
        UnexpectedReply: It is no list of that length, as for the other functions here.
    """
    measured = map(as_number, sequence(values, "switches", len(SWITCHES)))
    return {name: value > 0.5 for name, value in zip(SWITCHES, measured, strict=True) if not math.isnan(value)}


def read_battery(values: Any) -> Battery:
    """The battery, from what getListData answered for `BATTERY_KEYS`."""
    charge, current, plugged = sequence(values, "battery", len(BATTERY_KEYS))
    return Battery(as_number(charge), as_number(current), bool(plugged) if plugged is not None else None)


def temperature_keys(joints: Sequence[str]) -> list[str]:
    return [f"{_DEVICE}/{joint}/Temperature/Sensor/{kind}" for joint in joints for kind in ("Value", "Status")]


def read_temperatures(joints: Sequence[str], values: Any) -> Temperatures:
    """Temperatures from what getListData answered for `temperature_keys(joints)`; joints without a sensor are left
    out."""
    values = sequence(values, "temperatures", 2 * len(joints))
    celsius, status = {}, {}
    for joint, value, state in zip(joints, values[::2], values[1::2], strict=True):
        if not math.isnan(as_number(value)):
            celsius[joint] = as_number(value)
            status[joint] = int(as_number(state)) if not math.isnan(as_number(state)) else 0
    return Temperatures(celsius, status)


def read_info(values: Any) -> str:
    """What the robot is, "key: value ; key: value", from what getListData answered for `INFO_KEYS`; what it does not
    know is left out."""
    known = zip(INFO_KEYS, sequence(values, "info", len(INFO_KEYS)), strict=True)
    return " ; ".join(f"{key}: {clean(value)}" for key, value in known if isinstance(value, str | int | float))
