"""One fault of one process: drive, kill or freeze it, watch until the robot rests and drives again, or goes on."""

from __future__ import annotations

import random
import re
import signal
import time
from collections.abc import Callable
from dataclasses import asdict, astuple, dataclass
from pathlib import Path

from telepresence.station import processes

from .pilots import Pilot, TopicPilot
from .station import Robot, Station
from .trace import Sample, drive_time, path_length, rest_time
from .victims import alive, frozen

THE_WINDOW = ("Xvfb", "/gui_ros_node")
"""Victims without which there is no window to say anything in."""
NOBODY = "nobody"
"""The victim of no fault: what letting go of the key takes by itself."""
UNDER_WAY = 0.8
"""Share of the speed that counts as driving."""
STEADY = 0.5
"""It drives for so long at least before the fault [s]."""
START_TIMEOUT = 15.0
GOES_ON, SUPERVISED_GOES_ON = 2.0, 4.0
"""A robot that has not come to rest for so long after the fault goes on, and its key is let go [s]. systemd waits two
seconds for a station that is frozen, and then ends it."""
REST_TIMEOUT = 4.0
"""After the release [s]."""
HELD = 1.0
"""So long after the fault the held key alone is to bring the robot back [s]; then it is pressed anew ..."""
PRESS, PAUSE = 0.6, 0.1
"""... for so long, again and again, with pauses [s]."""
BACK_TIMEOUT = 12.0
LISTEN = 1.5
"""A key that is not held moves nothing for so long [s]."""
CONTINUED = 0.1
"""A program that was frozen and is not so long after was continued by whoever started it [s]."""
FRESH = 0.2
"""A trace without a sample for so long is broken [s]."""


@dataclass
class Outcome:
    """What one fault did; None where there is nothing to say. Times are seconds after the fault."""

    station: str
    robot: str
    by: str
    victim: str
    fault: str
    rest: float | None = None
    """None: it went on, or its simulation was gone."""
    release: float | None = None
    """Seconds from letting go to rest, for a robot that went on."""
    goes_on: bool = False
    gone: bool = False
    """The simulated robot itself was away: nobody could see it."""
    told: float | None = None
    where: str = ""
    said: str = ""
    back: float | None = None
    """Drives again; 0 when it never stopped. For a fault of the link: after its end, or after the next press."""
    stale: float = 0.0
    """Driven with no key held, after it had come to rest [m]."""
    harmless: bool = False
    """The fault took nothing from the pilot, whose commands all went through, or was over at once: there is nothing to
    tell."""
    note: str = ""

    def as_dict(self) -> dict:
        return asdict(self)


class NotReady(Exception):
    """The station does not drive: bring up another one."""


@dataclass
class Run:
    """What a trial needs: a station, the robot that is driven, whoever drives it."""

    station: Station
    robot: Robot
    pilot: Pilot
    restarter: TopicPilot
    random: random.Random
    traces: Path | None = None
    """Folder for what was recorded of each fault."""

    def trace(self, since: float) -> list[Sample]:
        return self.station.truths[self.robot.name].since(since)

    def newest(self) -> Sample | None:
        return self.station.truths[self.robot.name].newest

    def save(self, outcome: Outcome, began: float) -> None:
        """Write where the robot was, from a second before the fault on: seconds, metres, radians."""
        if self.traces is None:
            return
        words = re.sub(r"\W+", "_", f"{outcome.robot} {outcome.by} {outcome.victim} {outcome.fault}")
        with (self.traces / f"{words}_{began:.0f}.csv").open("w") as file:
            print("time,x,y,yaw,ahead,speed,turn", file=file)
            for sample in self.trace(began - 1.0):
                print(
                    f"{sample.time - began:.3f}", *(f"{value:.4f}" for value in astuple(sample)[1:]), sep=",", file=file
                )

    def drives(self) -> bool:
        sample = self.newest()
        return sample is not None and sample.speed > UNDER_WAY * self.robot.speed


def wait(condition: Callable[[], object], timeout: float) -> bool:
    """Whether the condition has come true within `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


def start_driving(run: Run) -> None:
    """From the start of the world at full speed. Raises NotReady."""
    run.pilot.release()
    if problem := run.restarter.restart_world():
        raise NotReady(f"the simulated world does not return to its start: {problem}")
    deadline = time.monotonic() + START_TIMEOUT
    while True:
        run.pilot.approach()
        run.pilot.hold()
        if wait(run.drives, 3.0):
            time.sleep(STEADY + run.random.uniform(0.0, 0.3))  # at any moment of every loop's period
            if run.drives():
                return
        run.pilot.release()
        if time.monotonic() > deadline:
            raise NotReady("the robot does not drive")
        time.sleep(PAUSE)


def strike(run: Run, victim: str, pid: int, fault: str) -> Outcome:
    """Kill or freeze a process while the robot drives, and say what came of it; with NOBODY, do neither. Raises
    NotReady."""
    outcome = Outcome(run.station.label, run.robot.name, run.station.by, victim, fault)
    start_driving(run)
    began = time.monotonic()
    if victim != NOBODY:
        processes.send(pid, signal.SIGKILL if fault == "kill" else signal.SIGSTOP)
    woken = fault == "freeze" and not stays_frozen(pid)
    try:
        _watch(run, outcome, began)
    finally:
        if victim != NOBODY and frozen(pid):
            _wake(run, outcome, pid)
    if woken:
        outcome.harmless = outcome.goes_on
        outcome.note = "continued at once"
    note_sentence(run, outcome, began)
    run.save(outcome, began)
    return outcome


def stays_frozen(pid: int) -> bool:
    """Whether a process stays frozen, or has ended of it: tmux continues its shell as soon as that stops."""
    time.sleep(CONTINUED)
    return frozen(pid) or not alive(pid)


def _watch(run: Run, outcome: Outcome, began: float) -> None:
    def rest() -> float | None:
        return rest_time(run.trace(began), began)

    truth = run.station.truths[run.robot.name]
    wait(lambda: rest() is not None or truth.silent, SUPERVISED_GOES_ON if run.station.supervised else GOES_ON)
    outcome.rest = rest()
    rested = began + (outcome.rest or 0.0)
    if outcome.rest is None and truth.silent:
        outcome.gone = True
        rested = time.monotonic()
    elif outcome.rest is None:
        outcome.goes_on, outcome.back = True, 0.0
        outcome.release = _let_go(run)
        outcome.stale = _stale(run)
        return
    outcome.back = _come_back(run, began, rested)
    _let_go(run)
    outcome.stale = _stale(run)
    late = rest()
    if outcome.gone and late is not None and began + late < rested:  # the robot was only not heard of, as it stood
        outcome.gone, outcome.rest = False, late


def _come_back(run: Run, began: float, rested: float) -> float | None:
    """Seconds from the fault until the robot drives by the key that is held, or by a new press."""

    def back() -> float | None:
        return drive_time(run.trace(rested), began, 0.5 * run.robot.speed)

    if not run.station.running:
        return None  # nobody starts it again, and what still drives is coming to its end
    if wait(lambda: back() is not None, max(0.0, began + HELD - time.monotonic())):
        return back()
    while time.monotonic() < began + BACK_TIMEOUT and run.station.running:
        run.pilot.release()
        time.sleep(PAUSE)
        run.pilot.hold()
        if wait(lambda: back() is not None, PRESS):
            return back()
    return back()


def _let_go(run: Run) -> float | None:
    """Release the key; seconds until the robot rests."""
    released = time.monotonic()
    run.pilot.release()
    wait(lambda: rest_time(run.trace(released), released) is not None, REST_TIMEOUT)
    return rest_time(run.trace(released), released)


def _stale(run: Run) -> float:
    """Metres driven from now on, with no key held."""
    began = time.monotonic()
    time.sleep(LISTEN)
    return path_length(run.trace(began), began)


def _wake(run: Run, outcome: Outcome, pid: int) -> None:
    """A frozen program that nobody has ended goes on: what it still held must move nothing."""
    run.pilot.release()
    outcome.note = "stayed frozen"
    wait(lambda: (sample := run.newest()) is None or not sample.moves, REST_TIMEOUT)
    processes.send(pid, signal.SIGCONT)
    if outcome.gone:
        return  # for a simulated robot no time has passed: it only ends the motion that it was in
    outcome.stale = max(outcome.stale, _stale(run))
    if not alive(pid):
        outcome.note += ", then died"


def note_sentence(run: Run, outcome: Outcome, began: float) -> None:
    """Add the first thing that the station said after the fault; of a station with a window, the window, unless that
    itself was the victim."""
    said = run.station.sayings.since(began)
    has_window = run.station.by == "window" and outcome.victim not in THE_WINDOW
    shown = [sentence for sentence in said if sentence.where == "window"]
    first = next(iter((shown if has_window else []) or said), None)
    if first is not None:
        outcome.told, outcome.where, outcome.said = first.time - began, first.where, first.text
