"""Small trials of the gate with the benchmark's noisy robots: escape, slide, doorway, empty space, reaction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from safety.faults import LinkCut
from safety.gates import OurGate
from safety.robots import INFRARED_ROBOT, LASER_ROBOT, MEASURED_ROBOT, PEPPER_ROBOT, TICK, BenchRobot
from safety.run import Run
from safety.suite import in_parallel
from safety.tick import tick_times
from safety.worlds import BOX, FRAME, INFRARED_REACH, NOWHERE, THICK, WALL, Batch, Place

from telepresence.safety.braking import stopping_distance

AWAY_WITHIN = 0.5
"""An away-command must be obeyed after this [s]."""
OBEYED = 0.8
"""... with this share of what was asked."""


class Script:
    """A pilot who follows a script, in the place of `pilots.Pilots`."""

    def __init__(self, count: int, decide: Callable[[float, np.ndarray], np.ndarray]) -> None:
        """
        Args:
            decide: (time [s], pose (S, 3)) -> commands (S, 3).
        """
        self.kind = np.zeros(count, int)
        self.delay = np.zeros(count)
        self.reached = np.zeros(count, int)
        self._decide = decide
        self._decisions = 0

    def decide(self, pose: np.ndarray, circles: np.ndarray, true_pose: np.ndarray) -> np.ndarray:
        now = self._decisions * 0.1
        self._decisions += 1
        return self._decide(now, pose)


@dataclass(frozen=True)
class Trial:
    """Figures of one small trial.

    Args:
        robot: Key of `ROBOTS`.
        values: By name, in `unit` unless the name says otherwise.
        judged: Name of the value that is compared with `wanted`.
    """

    robot: str
    name: str
    values: dict[str, float]
    judged: str
    wanted: float
    unit: str


@dataclass(frozen=True)
class Escapes:
    """Away-commands from breaches: how many were given, and how many obeyed in time."""

    asked: int
    obeyed: int


def _place(start: tuple[float, float, float]) -> Place:
    place = Place(width=2.0 * NOWHERE, depth=2.0 * NOWHERE, start=start)
    place.circles.append((NOWHERE, NOWHERE, 0.0, THICK))
    place.segments.append((NOWHERE, NOWHERE, NOWHERE + 1.0, NOWHERE, WALL))
    return place


def _wall(place: Place, distance: float, bearing: float, kind: int = WALL) -> None:
    """A long wall at a distance from the origin, seen under a bearing."""
    nx, ny = math.cos(bearing), math.sin(bearing)
    x, y = distance * nx, distance * ny
    place.segments.append((x - 8.0 * -ny, y - 8.0 * nx, x + 8.0 * -ny, y + 8.0 * nx, kind))


def escapes(robot: BenchRobot, count: int, seed: int) -> Escapes:
    """Command robots in breach of the margin at a wall, in a corner or at a pole to leave; half of them after a bump.

    The command points away from everything that is near, up to 60 degrees off the straight way out.
    """
    rng = np.random.default_rng([seed, 21])
    reach = robot.profile.outline.reach
    limits = robot.profile.limits
    places, ways = [], []
    for i in range(count):
        place = _place((0.0, 0.0, 0.0))
        bearing = rng.uniform(-math.pi, math.pi)
        gap = rng.uniform(0.002, limits.margin_beside)
        off = rng.uniform(-1.0, 1.0)
        if i % 3 == 0:
            _wall(place, _support(robot, bearing) + gap, bearing)
        elif i % 3 == 1:
            _wall(place, _support(robot, bearing) + gap, bearing)
            _wall(place, _support(robot, bearing + 0.5 * math.pi) + gap, bearing + 0.5 * math.pi)
            bearing, off = bearing + 0.25 * math.pi, 0.5 * off
        else:
            radius = rng.uniform(0.01, 0.2)
            # Place the pole so that its rim is `gap` from the outline along the normal there.
            at = float(reach(np.array([bearing]))[0]) + gap + radius
            place.circles.append((at * math.cos(bearing), at * math.sin(bearing), radius, THICK))
        places.append(place)
        ways.append(bearing + math.pi + off * math.radians(60.0) * (0.9 if i % 3 == 1 else 1.0))
    speed = limits.escape_speed
    commands = np.stack([speed * np.cos(ways), speed * np.sin(ways), np.zeros(count)], axis=1)
    look = 1.0
    script = Script(count, lambda now, pose: commands if now >= look else np.zeros((count, 3)))
    gate = OurGate(robot, count)
    run = Run(robot, gate, Batch(places, seed), script, (seed, 1))
    obeyed = np.zeros(count, bool)
    direction = commands[:, :2] / speed
    for tick in range(round((look + AWAY_WITHIN) / TICK) + 1):
        if tick == round(look / TICK) - 2:
            for i in range(0, count, 2):
                gate.gates[i].update_bumper(tick * TICK, True, None)
                gate.gates[i].update_bumper(tick * TICK, False)
        run.step(tick)
        obeyed |= (run.sent[-1][:, :2] * direction).sum(axis=1) >= OBEYED * speed
    return Escapes(count, int(obeyed.sum()))


def slide(robot: BenchRobot, speed: float, count: int, seed: int, ahead: bool = False) -> np.ndarray:
    """Share of the tangential speed that is kept when driving 30 to 60 degrees into a wall, per robot.

    The robot starts 0.4 m before the wall; what is measured is its true motion along the wall in the 4 s after the time
    in which all have reached it.

    Args:
        ahead: Drive forward only, as a robot must whose sensors point there.
    """
    rng = np.random.default_rng([seed, 22])
    bearings = rng.uniform(-math.pi, math.pi, count)
    into = np.radians(rng.uniform(30.0, 60.0, count))
    side = rng.choice([-1.0, 1.0], count)
    way = bearings + side * (0.5 * math.pi - into)
    headings = way if ahead else np.zeros(count)
    places = []
    for i in range(count):
        place = _place((0.0, 0.0, float(headings[i])))
        _wall(place, _support(robot, float(bearings[i] - headings[i])) + 0.4, float(bearings[i]))
        places.append(place)
    way -= headings
    commands = np.stack([speed * np.cos(way), speed * np.sin(way), np.zeros(count)], axis=1)
    run = Run(robot, OurGate(robot, count), Batch(places, seed), Script(count, lambda now, pose: commands), (seed, 2))
    along = np.stack([-np.sin(bearings), np.cos(bearings)], axis=1)
    reached = round(max(4.0, 0.8 / speed) / TICK)
    for tick in range(reached + round(4.0 / TICK)):
        if tick == reached:
            before = run.pose.copy()
        run.step(tick)
    moved = ((run.pose - before)[:, :2] * along).sum(axis=1)
    return moved / (side * speed * np.cos(into) * 4.0)


def doorway(robot: BenchRobot, speed: float, count: int, seed: int, extra: float = 0.15) -> tuple[int, int]:
    """Robots drive through a door frame that is wider than the body by `extra` [m], up to 3 cm off its middle.

    Returns:
        How many got through in 3 times the free driving time, and how many touched it.
    """
    rng = np.random.default_rng([seed, 23])
    places = []
    for _ in range(count):
        place = _place((0.0, 0.0, 0.0))
        half = 0.5 * (_support(robot, 0.5 * math.pi) + _support(robot, -0.5 * math.pi) + extra)
        middle = rng.uniform(-0.03, 0.03)
        for side in (1.0, -1.0):
            y = middle + side * half
            for x in (0.8, 0.9):
                place.segments.append((x, y, x, y + side * 2.0, FRAME))
            place.segments.append((0.8, y, 0.9, y, FRAME))
        places.append(place)
    way = 0.9 + _support(robot, math.pi) + 0.1

    def decide(now: float, pose: np.ndarray) -> np.ndarray:
        # A pilot who keeps the heading and drives straight on.
        command = np.zeros((count, 3))
        command[:, 0] = speed
        return command

    run = Run(robot, OurGate(robot, count), Batch(places, seed), Script(count, decide), (seed, 3))
    outcome = run.drive(3.0 * way / speed)
    return int((run.pose[:, 0] > way).sum()), int((outcome.hits.sum(axis=1) > 0).sum())


def false_stops(robot: BenchRobot, speed: float, count: int, seconds: float, seed: int) -> float:
    """Share of the ticks in empty space in which the gate shows anything but CLEAR, or passes less than 95 %.

    The first second, in which nothing has been seen yet and the speed rises, is left out; so are starts after a turn
    of the command.
    """
    rng = np.random.default_rng([seed, 24])
    ways = rng.uniform(-math.pi, math.pi, (count, 64))
    # Looks where it drives: the direction changes by turning on the spot, as with a blind sector it must.
    turns = rng.choice([-0.5, 0.5], (count, 64))

    def decide(now: float, pose: np.ndarray) -> np.ndarray:
        phase, leg = math.fmod(now, 5.0), int(now / 5.0)
        command = np.zeros((count, 3))
        if phase < 1.5:
            command[:, 2] = turns[:, leg]
        else:
            command[:, 0] = speed
            command[:, 2] = 0.2 * np.sin(ways[:, leg])
        return command

    places = [_place((0.0, 0.0, 0.0)) for _ in range(count)]
    gate = OurGate(robot, count)
    run = Run(robot, gate, Batch(places, seed), Script(count, decide), (seed, 4))
    bad = ticks = 0
    for tick in range(round(seconds / TICK)):
        run.step(tick)
        phase = math.fmod(tick * TICK, 5.0)
        if tick * TICK < 1.0 or phase < 1.5 or phase > 4.9:
            continue
        settled = phase > 2.2
        given = np.hypot(run.sent[-1][:, 0], run.sent[-1][:, 1])
        cut = (given < 0.95 * speed) & settled
        shown = np.array([gate.state(i).value != "clear" for i in range(count)])
        bad += int((cut | shown).sum())
        ticks += count
    return bad / ticks


def thin_legs(robot: BenchRobot, speed: float, count: int, seed: int, reach: float = INFRARED_REACH) -> np.ndarray:
    """Robots with the careful scan drive at a leg of 2 to 6 cm, 0.3 to 1.5 m away, up to 20 cm off their way.

    Args:
        reach: How far their sensors see [m].
    Returns:
        The speeds of the contacts [m/s].
    """
    rng = np.random.default_rng([seed, 31])
    ways = rng.uniform(-math.pi, math.pi, count)
    places = []
    for way in ways:
        place = _place((0.0, 0.0, 0.0))
        ahead, aside = _support(robot, way) + rng.uniform(0.3, 1.5), rng.uniform(-0.2, 0.2)
        x, y = ahead * math.cos(way) - aside * math.sin(way), ahead * math.sin(way) + aside * math.cos(way)
        place.circles.append((x, y, rng.uniform(0.01, 0.03), THICK))
        places.append(place)
    commands = np.stack([speed * np.cos(ways), speed * np.sin(ways), np.zeros(count)], axis=1)
    script = Script(count, lambda now, pose: commands)
    outcome = Run(robot, OurGate(robot, count, careful=True), Batch(places, seed, reach), script, (seed, 7)).drive(12.0)
    return np.array([contact.speed for contact in outcome.contacts])


def reaction_to_obstacle(robot: BenchRobot, speed: float, gap: float, count: int, seed: int) -> np.ndarray:
    """Time from a box's appearing ahead, `gap` from the outline, to an output that can stop before it (S,) [s]."""
    rng = np.random.default_rng([seed, 25])
    places = []
    for _ in range(count):
        place = _place((0.0, 0.0, 0.0))
        place.segments.append((NOWHERE, NOWHERE, NOWHERE, NOWHERE + 0.4, BOX))
        places.append(place)
    batch = Batch(places, seed)
    commands = np.tile([speed, 0.0, 0.0], (count, 1))
    run = Run(robot, OurGate(robot, count), batch, Script(count, lambda now, pose: commands), (seed, 5))
    appears = np.round(rng.uniform(2.0, 3.0, count) / TICK).astype(int)
    took = np.full(count, math.nan)
    limits = robot.profile.limits
    for tick in range(round(5.0 / TICK)):
        for i in np.flatnonzero(appears == tick):
            x = run.pose[i, 0] + _support(robot, 0.0) + gap
            batch.segment[i, -1] = x, run.pose[i, 1] - 0.2, x, run.pose[i, 1] + 0.2
        run.step(tick)
        left = batch.segment[:, -1, 0] - run.pose[:, 0] - _support(robot, 0.0)
        v = run.sent[-1][:, 0]
        safe = v * limits.reaction + v * v / (2.0 * limits.braking) <= np.maximum(left, 0.0)
        done = (tick >= appears) & safe & np.isnan(took)
        took[done] = (tick - appears[done]) * TICK
    return took


def reaction_to_silence(robot: BenchRobot, speed: float, count: int, seed: int) -> np.ndarray:
    """Time from the last command's being due to the gate's zero (S,) [s]."""
    commands = np.tile([speed, 0.0, 0.0], (count, 1))
    places = [_place((0.0, 0.0, 0.0)) for _ in range(count)]
    script = Script(count, lambda now, pose: commands)
    return (
        Run(robot, OurGate(robot, count), Batch(places, seed), script, (seed, 6), LinkCut()).drive(12.0).stopped_after
    )


ROBOTS = {
    "infrared": (INFRARED_ROBOT, 0.20),
    "measured": (MEASURED_ROBOT, 0.20),
    "laser": (LASER_ROBOT, 0.35),
    "pepper": (PEPPER_ROBOT, 0.35),
}
"""Robots, and the speed of their trials [m/s]."""
SEED = 9100
"""Seed of the published figures."""


def _escapes(robot: BenchRobot, speed: float, share: float) -> tuple:
    found = escapes(robot, round(300 * share), SEED)
    percent = 100.0 * found.obeyed / found.asked
    return "away-commands obeyed within 0.5 s", dict(obeyed=percent, of=found.asked), "obeyed", 100.0, "%"


def _slide(robot: BenchRobot, speed: float, share: float) -> tuple:
    # Pepper's sensors point ahead, so it drives ahead; along the wall no sensor sees the way.
    ahead = robot is PEPPER_ROBOT
    speeds = (robot.profile.limits.unseen_speed, speed) if ahead else (speed,)
    kept = [100.0 * slide(robot, v, round(60 * share), SEED, ahead) for v in speeds]
    values = dict(mean=kept[0].mean(), median=np.median(kept[0]), worst_20th=np.percentile(kept[0], 5))
    if ahead:
        values[f"mean when sent at {speed:.2f} m/s"] = kept[1].mean()
    return f"tangential speed kept at a wall{' at 0.10 m/s' if ahead else ''}", values, "mean", 90.0, "%"


def _doorway(robot: BenchRobot, speed: float, share: float) -> tuple:
    count = round(40 * share)
    through, touched = doorway(robot, speed, count, SEED)
    return "through a door 0.15 m wider", dict(through=100.0 * through / count, touched=touched), "through", 100.0, "%"


def _false_stops(robot: BenchRobot, speed: float, share: float) -> tuple:
    found = 100.0 * false_stops(robot, speed, round(24 * share), 40.0, SEED)
    return "false stops in empty space", dict(share=found), "share", 1.0, "%"


def _thin_legs(robot: BenchRobot, speed: float, share: float) -> tuple:
    count = round(200 * share)
    speeds = thin_legs(robot, speed, count, SEED)
    values = {"touched": len(speeds), "of": count, "fastest in m/s": speeds.max(initial=0.0)}
    return "thin legs, careful scan", values, "touched", 0.0, ""


def _thin_legs_seen_late(robot: BenchRobot, speed: float, share: float) -> tuple:
    count = round(200 * share)
    speeds = thin_legs(robot, speed, count, SEED, robot.profile.source("infrared").clear_range)
    values = {"fastest in m/s": speeds.max(initial=0.0), "touched": len(speeds), "of": count}
    # Half the energy of a contact that does no harm.
    limit = math.sqrt(0.5) * robot.profile.limits.unseen_speed
    return "the same, sensors that see 30 cm", values, "fastest in m/s", limit, ""


def _to_obstacle(robot: BenchRobot, speed: float, share: float) -> tuple:
    limits = robot.profile.limits
    gap = 0.5 * stopping_distance(speed, limits.reaction, limits.braking)
    took = reaction_to_obstacle(robot, speed, gap, round(60 * share), SEED)
    values = dict(p50=np.median(took), p95=np.percentile(took, 95), most=took.max())
    return "obstacle appears to safe speed", values, "p95", 0.35, "s"


def _to_silence(robot: BenchRobot, speed: float, share: float) -> tuple:
    took = reaction_to_silence(robot, speed, round(40 * share), SEED)
    values = dict(p50=np.median(took), p95=np.percentile(took, 95), most=took.max())
    return "commands cease to zero", values, "p95", 0.35, "s"


def _tick(robot: BenchRobot, speed: float, share: float) -> tuple:
    # Three times the very same ticks, the least time of each: what else the machine did isn't the gate's.
    times = 100.0 * np.min([tick_times(robot, round(2000 * share), SEED) for _ in range(3)], axis=0) / TICK
    values = dict(p50=np.median(times), p99=np.percentile(times, 99), most=times.max())
    return "processor time of a tick, share of its period", values, "p99", 2.0, "%"


SWING_ONLY = (_thin_legs, _thin_legs_seen_late)
KINDS = (_escapes, _slide, _doorway, _false_stops, *SWING_ONLY, _to_obstacle, _to_silence, _tick)


def run_trials(share: float = 1.0) -> list[Trial]:
    """All trials with all robots, or with a share of the repetitions. What a tick costs is measured last, alone: two at
    once slow each other down, processor time or not."""
    jobs = [
        (name, kind, share)
        for name in ROBOTS
        for kind in range(len(KINDS))
        if KINDS[kind] not in SWING_ONLY or ROBOTS[name][0].profile.swing
    ]
    timed = [job for job in jobs if KINDS[job[1]] is _tick]
    found = [*in_parallel(_job, [job for job in jobs if job not in timed]), *map(_job, timed)]
    return [trial for _, trial in sorted(found, key=lambda pair: jobs.index(pair[0]))]


def _job(job: tuple[str, int, float]) -> tuple[tuple[str, int, float], Trial]:
    name, kind, share = job
    trial, values, judged, wanted, unit = KINDS[kind](*ROBOTS[name], share)
    return job, Trial(name, trial, {key: float(value) for key, value in values.items()}, judged, wanted, unit)


def _support(robot: BenchRobot, bearing: float) -> float:
    """Distance from base_link to the line that touches the outline in a direction [m]."""
    direction = np.array([math.cos(bearing), math.sin(bearing)])
    return float((robot.hull.corners @ direction).max()) + robot.hull.radius
