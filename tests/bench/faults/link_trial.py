"""One fault of the link: drive, spoil it, let go of the key or press another one meanwhile, free it, watch."""

from __future__ import annotations

import time
from dataclasses import replace

from .far_station import FarStation
from .trace import Sample, drive_time, path_length, rest_time, way_ahead
from .trial import LISTEN, PAUSE, PRESS, Outcome, Run, note_sentence, start_driving, wait

FAULTS = ("cut", "stall", "delay", "reset")
KEYS = ("released", "reversed")
"""What the pilot does meanwhile. Who holds the key all the time gives new commands that look like the old ones: so the
other hand presses backward, and whatever moves the robot forward from then on is old."""
LASTS = (2.0, 3.0)
DELAY = 0.5
"""One way [s]."""
KEY_AFTER = 0.2
"""The key changes at most so long after the fault [s]."""
BACK_TIMEOUT = 8.0
AT_ONCE = 0.5
"""A command that is obeyed so soon went through [s]: a reset ends TCP connections, and datagrams know none."""
CREEPS = 0.04
"""Faster than this is driving, also backward, where Pepper hardly sees [m/s]."""


def strike_link(run: Run, fault: str, key: str) -> Outcome:
    """Return what a fault of the link did. Raises NotReady."""
    station = run.station
    assert isinstance(station, FarStation)
    outcome = Outcome(run.robot.name, run.robot.name, "topic", "link", f"{fault}, key {key}")
    start_driving(run)
    began = time.monotonic()
    spoil(station, fault)
    try:
        time.sleep(run.random.uniform(0.0, KEY_AFTER))
        changed = time.monotonic()
        if key == "released":
            run.pilot.release()
        else:
            station.pilot.drive(-run.robot.speed, 0.0)
        time.sleep(max(0.0, began + run.random.uniform(*LASTS) - time.monotonic()))
    finally:
        station.calm()
    returned = time.monotonic()
    # A reset takes no command away: only the key ends the motion then.
    since = changed if fault == "reset" else began
    if key == "released":
        time.sleep(LISTEN)
        outcome.rest = rest_time(run.trace(since), since)
        outcome.stale = path_length(run.trace(began), since + (outcome.rest or 0.0))
        outcome.back = _press(run)
    else:
        wait(lambda: drive_time(run.trace(returned), returned, CREEPS) is not None, BACK_TIMEOUT)
        outcome.back = drive_time(run.trace(returned), returned, CREEPS)
        time.sleep(LISTEN)
        outcome.rest = rest_time(forward_only(run.trace(since)), since)
        outcome.stale = way_ahead(run.trace(began), since + (outcome.rest or 0.0))
    run.pilot.release()
    wait(lambda: (sample := run.newest()) is None or not sample.moves, 2.0)
    note_sentence(run, outcome, began)
    outcome.harmless = fault == "reset" and outcome.back is not None and outcome.back < AT_ONCE
    run.save(outcome, began)
    return outcome


def spoil(station: FarStation, fault: str) -> None:
    """Begin a fault of the link."""
    if fault == "cut":
        station.link.cut = True
    elif fault == "stall":
        station.link.stalled = True
    elif fault == "delay":
        station.link.delay = DELAY
    else:
        station.link.reset()


def forward_only(trace: list[Sample]) -> list[Sample]:
    """As if the robot stood whenever it does not drive forward."""
    return [replace(sample, speed=max(0.0, sample.ahead), turn=0.0) for sample in trace]


def _press(run: Run) -> float | None:
    """Seconds from a new press of the key, repeated where it takes one, to driving."""
    pressed = time.monotonic()
    while time.monotonic() < pressed + BACK_TIMEOUT:
        run.pilot.hold()
        if wait(lambda: drive_time(run.trace(pressed), pressed, CREEPS) is not None, 2 * PRESS):
            break
        run.pilot.release()
        time.sleep(PAUSE)
    return drive_time(run.trace(pressed), pressed, CREEPS)
