"""The readable paths under /data and their answers, in the vendor's words and units.

Sources: wiki.openrobotino.org, page Rest api (27 July 2020), and replies of a robot with image 4.20.9 recorded in
alexkorga/hsbi-robotino-navigation, docs/reference/robotino_http_api_inventory.md, /data/pose included, which that
robot answers on port 8154 of an additional service. `EMPTY` stands for hardware that this
robot does not have: the real one then answers 200 with an empty body.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robotino_sim import laser
from robotino_sim.power import KINDS, PowerState
from robotino_sim.programs import Programs
from robotino_sim.robot import Robotino

EMPTY = object()
IMAGE_VERSION = "4.20.9\n"
HARDWARE, SOFTWARE = "3.0.0", "1.2.3"
CHARGER_STATES = (
    *("None", "Idle", "Monitor", "CheckBattery", "No battery", "NTC Error", "Start"),
    *("Stage1", "Stage2", "Stage3", "Stage4", "Error", "Unknown"),
)
"""States in the vendor's order; that a state's number is its index here is a guess, as are the three figures below."""
CHARGER_VERSION, BATTERY_TEMPERATURE, CHARGING_CURRENT = "1.0", 25, 2
"""Text, [°C], [A]."""

SERVICES: dict[str, tuple[tuple[str, bool], ...]] = {
    "robotino-daemons": (
        *(("restapid", True), ("controld3", True), ("camd2", True), ("rpcd", True)),
        *(("controld2", False), ("gyrod", False), ("realsensed", False)),
        *(("laserd3_ethernet", False), ("laserd3_serial", False)),
    ),
    "robotino-smartsoft-master": (("SmartAmcl", False), ("SmartMapperGridMap", False)),
    "robotino-smartsoft-slave": (("ComponentRobotinoBaseServer", False), ("ComponentRobotinoLaserServer", False)),
    "robotino-cobotta": (),
}
"""Group -> (service, whether it runs), from the answers of the recorded robot."""

Reading = Callable[[Robotino], Any]


def odometry(robot: Robotino) -> list[float]:
    """[x m, y m, rot rad, vx m/s, vy m/s, omega rad/s, seq]."""
    reading = robot.snapshot().odometry
    return [reading.x, reading.y, reading.phi, reading.vx, reading.vy, reading.omega, reading.seq]


def pose(robot: Robotino) -> dict[str, float]:
    """Where the robot believes to be in the room [m, rad]. The recorded errors are 0, their meaning is unknown."""
    reading = robot.snapshot().localization
    return {
        **{"errphi": 0, "errx": 0, "erry": 0},
        **{"phi": reading.phi, "seq": reading.seq, "x": reading.x, "y": reading.y},
    }


def power_management(robot: Robotino) -> dict[str, Any]:
    power = robot.snapshot().power
    return {
        "batteryLow": power.low,
        "batteryLowShutdownCounter": power.shutdown_counter,
        "batteryType": power.kind,
        "ext_power": power.external,
        "num_chargers": KINDS[power.kind].chargers,
        "voltage": power.voltage,
    }


def festool_charger(robot: Robotino) -> Any:
    snapshot = robot.snapshot()
    power = snapshot.power
    packs = KINDS[power.kind].packs
    if not packs:
        return EMPTY
    return {
        "TYPE": "FESTOOL_CHARGER_INFO",
        "payload": {
            "time": round(1000 * snapshot.time),
            "accuLoading": [int(power.external)] * packs,
            "accuConnected": [1] * packs,
            "externalPower": power.external,
            "chargerConnected": power.external,
            "voltages": [power.voltage] * packs,
            "capacities": [round(100 * power.charge)] * packs,
            "message": "",
        },
    }


def charger(number: int) -> Reading:
    """Return the reading of built-in charger `number`."""

    def read(robot: Robotino) -> Any:
        snapshot = robot.snapshot()
        power = snapshot.power
        if number >= KINDS[power.kind].chargers:
            return EMPTY
        state = _charger_state(power)
        return {
            "bat1temp": BATTERY_TEMPERATURE,
            "bat2temp": BATTERY_TEMPERATURE,
            "batteryVoltage": power.voltage,
            "chargerNumber": number,
            "chargingCurrent": CHARGING_CURRENT if state == "Stage1" else 0,
            "state": state,
            "state_number": CHARGER_STATES.index(state),
            "time": round(1000 * snapshot.time),
            "version": CHARGER_VERSION,
        }

    return read


def scan(robot: Robotino) -> Any:
    reading = robot.snapshot().scan
    if reading is None:
        return EMPTY
    return {
        "seq": reading.seq,
        "stamp": round(1000 * reading.stamp),
        "angle_min": laser.ANGLE_MIN,
        "angle_max": laser.ANGLE_MAX,
        "angle_increment": laser.ANGLE_INCREMENT,
        "time_increment": 0.0,
        "scan_time": laser.PERIOD,
        "range_min": laser.RANGE_MIN,
        "range_max": laser.RANGE_MAX,
        "ranges": reading.ranges,
        "intensities": [0] * len(reading.ranges),
    }


def services(_: Robotino) -> list[dict[str, Any]]:
    """Return the groups and their members, for readers of either form: a list of names, or nodes of a tree as the
    vendor's web application shows them (`_children`, as in the mirrored restapid's ConfigHandler.cpp)."""
    return [
        {
            "name": group,
            "services": [name for name, _ in members],
            "_children": [{"name": name} for name, _ in members],
        }
        for group, members in SERVICES.items()
    ]


def service_status(name: str) -> list[str] | None:
    """Return the text records of one service; None if there is no such service."""
    for members in SERVICES.values():
        for service, runs in members:
            if service == name:
                state = "active (running)" if runs else "inactive (dead)"
                return [f"{name}.service", f"Active: {state}"]
    return None


def table(programs: Programs) -> dict[str, Reading]:
    """Return path -> reading."""
    return {
        "/data/odometry": odometry,
        "/data/pose": pose,
        "/data/distancesensorarray": lambda robot: robot.snapshot().distances,
        "/data/bumper": lambda robot: {"value": robot.snapshot().bumper},
        "/data/analoginputarray": lambda robot: robot.inputs_outputs.analog_inputs,
        "/data/digitalinputarray": lambda robot: robot.inputs_outputs.digital_inputs,
        "/data/digitaloutputstatus": lambda robot: robot.inputs_outputs.digital_outputs,
        "/data/relaystatus": lambda robot: robot.inputs_outputs.relays,
        "/data/powermanagement": power_management,
        "/data/festoolcharger": festool_charger,
        "/data/charger0": charger(0),
        "/data/charger1": charger(1),
        "/data/controllerinfo": lambda _: {
            "TYPE": "CONTROLLER_INFO",
            "payload": {"hardware": HARDWARE, "software": SOFTWARE},
        },
        "/data/imageversion": lambda _: {"version": IMAGE_VERSION},
        "/data/poweroutputcurrent": lambda robot: {"current": robot.inputs_outputs.power_output_current},
        "/data/scan0": scan,
        "/data/services": services,
        # Requested by the robot's own web pages.
        "/data/config": lambda _: [],
        "/data/program": lambda _: programs.listing(),
        "/data/globalvars": lambda _: [],
        "/data/robviewout": lambda _: [],
        "/data/wlanconfig": lambda _: [],
        "/data/wlanhwfound": lambda _: {"found": False},
    }


def _charger_state(power: PowerState) -> str:
    if not power.external:
        return "Idle"
    return "Stage1" if power.charge < 1.0 else "Stage4"
