"""The writable paths under /data and what each does with its body, in the vendor's words and units.

A body is checked completely before anything happens, so that a bad one has no effect. Programs in use send 1 and 0 for
true and false, alone and in arrays. Source: wiki.openrobotino.org,
page Rest api (27 July 2020); the program paths: restapid's ProgramHandler.cpp (mirror BusHero/robotino_api2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from robotino_sim.inputs_outputs import DIGITAL_OUTPUTS, MAX_POWER, RELAYS
from robotino_sim.json_body import MAX_COMMAND, MAX_PROGRAM
from robotino_sim.programs import Programs
from robotino_sim.robot import Robotino
from telepresence.web.json_app import boolean, booleans, index, member, number, numbers


@dataclass(frozen=True)
class Command:
    """`run(body)` takes the parsed body and may raise BadRequest; `limit` is the largest body [bytes]."""

    run: Callable[[Any], None]
    limit: int = MAX_COMMAND


def table(robot: Robotino, programs: Programs) -> dict[str, Command]:
    """Return path -> command."""
    outputs = robot.inputs_outputs

    def omnidrive(body: Any) -> None:
        robot.set_velocity(*numbers(body, 3, "[vx, vy, omega] in m/s, m/s and rad/s"))

    def digital_output(body: Any) -> None:
        meaning = f'{{"num": 0..{DIGITAL_OUTPUTS - 1}, "val": true or false}}'
        num = index(member(body, "num", meaning), DIGITAL_OUTPUTS, meaning)
        outputs.set_digital_output(num, boolean(member(body, "val", meaning), meaning))

    def digital_output_array(body: Any) -> None:
        outputs.set_digital_outputs(booleans(body, DIGITAL_OUTPUTS, "the digital outputs"))

    def relay(body: Any) -> None:
        meaning = f'{{"num": 0..{RELAYS - 1}, "val": true or false}}'
        num = index(member(body, "num", meaning), RELAYS, meaning)
        outputs.set_relay(num, boolean(member(body, "val", meaning), meaning))

    def relay_array(body: Any) -> None:
        outputs.set_relays(booleans(body, RELAYS, "the relays"))

    def power_output(body: Any) -> None:
        meaning = f'{{"value": -{MAX_POWER:.0f}..{MAX_POWER:.0f}}} in percent'
        outputs.set_power_output(number(member(body, "value", meaning), meaning))

    return {
        "/data/omnidrive": Command(omnidrive),
        "/data/digitaloutput": Command(digital_output),
        "/data/digitaloutputarray": Command(digital_output_array),
        "/data/relay": Command(relay),
        "/data/relayarray": Command(relay_array),
        "/data/poweroutput": Command(power_output),
        "/data/uploadProgram": Command(programs.upload, MAX_PROGRAM),
        "/data/startStopProgram": Command(programs.start_or_stop),
        "/data/remove": Command(programs.remove),
        "/data/renameprogram": Command(programs.rename),
    }
