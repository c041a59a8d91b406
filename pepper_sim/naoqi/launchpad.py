"""Launchpad: what NAOqi's launch conditions ask about, the robot's own part of it: battery, posture, motors, time.

Source: NAOqi 2.8 documentation, launch trigger conditions, which gives the words but not where one begins.
"""

from __future__ import annotations

import datetime
from typing import Any

from pepper_sim.naoqi.identity import ROBOT_TYPE

EMPTY_PERCENT, LOW_PERCENT, FULL_PERCENT = 10, 30, 80
"""Charges [%] at which the battery becomes Low, Half and Full; below the first it is Critical."""
WARM, HOT, TOO_HOT = 45.0, 75.0, 90.0
"""Motor temperatures [°C] at which the robot becomes Warm, Hot and Critical."""
FELL_RECENTLY = 13.0
"""Seconds, as documented."""
_LEVELS = 5


def values(
    snapshot: Any, posture: str, family: str, charging: bool, fell: float | None, now: datetime.datetime
) -> dict[str, Any]:
    """Return what is to be read under "Launchpad/...".

    Args:
        snapshot: The robot's last one.
        posture, family: The posture, and its family.
        charging: Whether the battery is being charged.
        fell: How long ago the robot fell [s]; None if it never did.
        now: By the robot's calendar.
    """
    charge = 100.0 * snapshot.battery.charge
    hottest = max(snapshot.temperatures, key=snapshot.temperatures.__getitem__)
    temperature = float(snapshot.temperatures[hottest])
    found = {
        "BatteryIsCharging": charging,
        "BatteryLevel": round(charge * _LEVELS / 100.0),
        "BatteryStatus": _word(charge, (EMPTY_PERCENT, LOW_PERCENT, FULL_PERCENT), ("Critical", "Low", "Half", "Full")),
        "RobotType": ROBOT_TYPE.lower(),
        "Lifted": False,
        "Posture": posture,
        "PostureFamily": family,
        "RobotFellRecently": fell is not None and fell < FELL_RECENTLY,
        "TemperatureStatus": _word(temperature, (WARM, HOT, TOO_HOT), ("Cold", "Warm", "Hot", "Critical")),
        "HighestTemperature": temperature,
        "HighestJoint": hottest,
        "Year": now.year,
        "Month": now.month,
        "MonthName": f"{now:%B}",
        "Day": now.timetuple().tm_yday,
        "DayName": f"{now:%A}",
        "Date": now.day,
        "Hour": now.hour,
    }
    return {f"Launchpad/{name}": value for name, value in found.items()}


def _word(value: float, limits: tuple[float, ...], words: tuple[str, ...]) -> str:
    """Return the word of the range that a value is in; there is one word more than limits."""
    return words[sum(value >= limit for limit in limits)]
