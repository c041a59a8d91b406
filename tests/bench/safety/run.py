"""Runs a gate through a batch of places and counts what happens."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from safety.faults import NO_FAULT, Fault
from safety.gates import Gate, MakeGate
from safety.pilots import PERIOD, REACTION, Pilots
from safety.robots import TICK, BenchRobot, measure
from safety.worlds import KINDS, PERSON, Batch, make_place

from telepresence.safety import Command, Odometry

SUBSTEPS = 2
"""Motion and contacts are computed this often per tick."""
DRIVES_INTO = 0.02
"""A contact with a person counts as the robot's if it moves towards it faster than this [m/s]."""
MOVES_INTO = 0.001
"""A contact with a thing counts if the rim moves towards it faster than this: the robot drove there [m/s]."""
PULLED_CLEAR = 0.05
"""Gap to which the robot is set back after a contact [m] ..."""
QUIET = 1.0
"""... and for this long no further contact is counted; then the bumper is reset [s]."""
STANDING = 0.02
"""[m/s]"""


@dataclass(frozen=True)
class Contact:
    """The robot drove into something.

    Args:
        place: Number of the scenario within its seed.
        time: [s].
        kind: Index into `KINDS`.
        bearing: Where on the body, from base_link [rad].
        speed: At which the rim met it [m/s].
        blind: The place on the body is in the view of no beam; a sonar's cone may reach it.
    """

    place: int
    time: float
    kind: int
    bearing: float
    speed: float
    blind: bool


@dataclass
class Outcome:
    """Counts per place; arrays of shape (S,) unless said otherwise."""

    commands: np.ndarray
    hits: np.ndarray  # (S, KINDS) first contacts; people only if the robot drove into them
    walked_into: np.ndarray
    impact: np.ndarray  # sum of the speeds at contact [m/s]
    hardest: np.ndarray  # [m/s]
    driven: np.ndarray  # [m]
    asked: np.ndarray  # sum of commanded speeds [m/s]
    passed: np.ndarray  # sum of the gate's speeds while commanded [m/s]
    asking: np.ndarray  # ticks with a commanded translation
    standing: np.ndarray  # ... that came to less than STANDING
    gap: np.ndarray  # least distance to things that stand, contacts included [m]
    goals: np.ndarray
    changes: np.ndarray  # of the shown state
    stopped_after: np.ndarray  # from the fault to the gate's first zero [s]; NaN without a fault or a zero
    pilot: np.ndarray
    contacts: list[Contact]

    @property
    def static_hits(self) -> np.ndarray:
        return self.hits.sum(1) - self.hits[:, PERSON]


def run(
    robot: BenchRobot,
    make_gate: MakeGate,
    *,
    seed: int,
    first: int,
    count: int,
    speed: float,
    seconds: float,
    people: int | None = None,
    fault: Fault = NO_FAULT,
) -> Outcome:
    """Drive `count` places, the first of them number `first` of `seed`, at `speed` [m/s] for `seconds`.

    Places, pilots, noise and faults depend on seed and number only, not on the gate.
    """
    radius = robot.profile.outline.outer_radius
    batch = Batch([make_place(seed, first + i, radius, people) for i in range(count)], seed * 1000 + first)
    gate = make_gate(robot, count)
    pilots = Pilots(batch, first, speed, radius, seed * 1000 + first)
    return Run(robot, gate, batch, pilots, (seed, first), fault).drive(seconds)


class Run:
    """Robots, pilots, gate and places that are stepped together.

    Args:
        pilots: Decides at 10 Hz; anything with the interface of `Pilots`.
        seed: Of noise, delays and faults.
    Attributes:
        pose, velocity: (S, 3) true ones, world and base_link.
        sent: Newest output of the gate last, one per substep, (S, 3) each.
        out: What has been counted.
    """

    def __init__(
        self,
        robot: BenchRobot,
        gate: Gate,
        batch: Batch,
        pilots: Pilots,
        seed: tuple[int, int],
        fault: Fault = NO_FAULT,
    ) -> None:
        count = len(batch)
        rng = np.random.default_rng([*seed, 3])
        self.first = seed[1]
        self.robot, self.gate, self.batch, self.fault = robot, gate, batch, fault
        self.hull = robot.hull
        self.pilots = pilots
        self.noise = np.random.default_rng([*seed, 5])
        fault.prepare(count, np.random.default_rng([*seed, 13]))
        self.pose = batch.start.copy()
        self.velocity = np.zeros((count, 3))
        low, high = robot.delay
        self.delay = np.round(rng.uniform(low, high, count) / TICK * SUBSTEPS).astype(int)
        kept = SUBSTEPS + math.ceil(high / TICK * SUBSTEPS)
        self.sent = deque([np.zeros((count, 3))] * kept, maxlen=kept)  # newest last, one per substep
        vary = rng.uniform(0.9, 1.1, count)
        self.acceleration, self.braking = robot.acceleration * vary, robot.braking * vary
        self.scale = 1.0 + np.clip(0.02 * rng.standard_normal((count, 2)), -0.04, 0.04)
        self.odometry = np.zeros((count, 3))
        self.seen: deque = deque(maxlen=20)  # what late pilots see: (pose in their heading, circles)
        self.delivery: dict[str, deque] = {name: deque() for name in robot.latency}
        self.quiet_until = np.full(count, -1.0)
        self.bumped = np.zeros(count, bool)
        self.out = Outcome(
            *(np.zeros(count) if name != "hits" else np.zeros((count, len(KINDS)))
              for name in list(Outcome.__dataclass_fields__)[:-3]),
            np.full(count, math.nan), self.pilots.kind, [],
        )  # fmt: skip
        self.out.gap[:] = math.inf
        self.command: list[Command | None] = [None] * count
        self.states = [None] * count

    def drive(self, seconds: float) -> Outcome:
        """Step to the end."""
        for tick in range(round(seconds / TICK)):
            self.step(tick)
        self.out.goals = self.pilots.reached.astype(float)
        return self.out

    def step(self, tick: int) -> None:
        """One tick of gate and sensors, two of motion."""
        now = tick * TICK
        swing = np.array([self.gate.swing(i) for i in range(len(self.batch))])
        self.seen.append((self.pose - swing[:, None] * (0.0, 0.0, 1.0), self.batch.circle.copy()))
        fresh = self._command(tick, now)
        self._sense(tick, now)
        self._decide(now, fresh)
        for _ in range(SUBSTEPS):
            self._move(TICK / SUBSTEPS)
            self._touch(now)

    def _command(self, tick: int, now: float) -> np.ndarray:
        """Pilots decide at 10 Hz; returns which commands have just come."""
        count = len(self.batch)
        if tick % round(PERIOD / TICK):
            return np.zeros(count, bool)
        late = np.minimum(np.round((self.pilots.delay + REACTION) / TICK).astype(int), len(self.seen) - 1)
        pose = np.stack([self.seen[-1 - late[i]][0][i] for i in range(count)])
        circles = np.stack([self.seen[-1 - late[i]][1][i] for i in range(count)])
        self.wanted = wanted = self.pilots.decide(pose, circles, self.pose)
        arrives = np.zeros(count, bool)
        for i in range(count):
            vx, vy, wz = (float(v) for v in wanted[i])
            stamp = self.fault.clock(i, now) - 0.5 * float(self.pilots.delay[i])
            for command in self.fault.commands(i, now, Command(vx, vy, wz, stamp)):
                self.command[i] = command
                arrives[i] = True
        self.out.commands += 1
        return arrives

    def _sense(self, tick: int, now: float) -> None:
        for source in self.robot.profile.sources:
            name = source.name
            waiting = self.delivery[name]
            if tick % self.robot.every[name] == 0:
                waiting.append((tick, measure(source, self.batch, self.pose, self.noise)))
            while waiting and waiting[0][0] <= tick - self.robot.latency[name]:
                measured, ranges = waiting.popleft()
                for i in range(len(self.batch)):
                    read = self.fault.ranges(i, now, name, ranges[i])
                    if read is not None:
                        at = self.fault.clock(i, now)
                        self.gate.sense(name, i, at, at - (tick - measured) * TICK, read)

    def _decide(self, now: float, fresh: np.ndarray) -> None:
        out = np.zeros((len(self.batch), 3))
        for i in range(len(self.batch)):
            at = self.fault.clock(i, now)
            x, y, theta = self.odometry[i].tolist()
            out[i] = self.gate.tick(at, i, self.command[i], bool(fresh[i]), Odometry(x, y, theta, at))
            state = self.gate.state(i)
            self.out.changes[i] += self.states[i] is not None and state is not self.states[i]
            self.states[i] = state
        speed = np.hypot(out[:, 0], out[:, 1])
        asked = np.hypot(self.wanted[:, 0], self.wanted[:, 1])
        asking = asked > 0.0
        self.out.asked += asked
        self.out.passed += np.where(asking, np.minimum(speed, asked), 0.0)
        self.out.asking += asking
        self.out.standing += asking & (speed < STANDING)
        since = self.fault.since(now)
        standing = (out == 0.0).all(axis=1)
        first = np.isnan(self.out.stopped_after) & (since >= 0.0) & standing
        self.out.stopped_after = np.where(first, since, self.out.stopped_after)
        for _ in range(SUBSTEPS):
            self.sent.append(out)

    def _move(self, dt: float) -> None:
        count = len(self.batch)
        # The newest entries of `sent` are for the present tick.
        target = np.stack([self.sent[-1 - self.delay[i]][i] for i in range(count)])
        change = target[:, :2] - self.velocity[:, :2]
        size = np.sqrt((change**2).sum(1))
        slowing = (change * self.velocity[:, :2]).sum(1) < 0.0
        step = np.where(slowing, self.braking, self.acceleration) * dt
        self.velocity[:, :2] += change * np.minimum(1.0, step / np.maximum(size, 1e-9))[:, None]
        turn = target[:, 2] - self.velocity[:, 2]
        slowing = turn * self.velocity[:, 2] < 0.0
        turn_step = np.where(slowing, self.robot.turn_braking, self.robot.turn_acceleration) * dt
        self.velocity[:, 2] += np.clip(turn, -turn_step, turn_step)
        _integrate(self.pose, self.velocity, dt)
        _integrate(self.odometry, self.velocity * self.scale[:, (0, 0, 1)], dt)
        self.out.driven += np.hypot(self.velocity[:, 0], self.velocity[:, 1]) * dt
        self.batch.walk(self.pose[:, :2], self.robot.profile.outline.outer_radius, dt)

    def _touch(self, now: float) -> None:
        """Count first contacts, and pull the robot clear by the same rule for every gate."""
        gap, place, inner = self.hull.contacts(self.batch, self.pose)
        circles = self.batch.circle.shape[1]
        people = self.batch.circle_kind == PERSON
        standing = gap.copy()
        standing[:, :circles][people] = math.inf
        self.out.gap = np.minimum(self.out.gap, standing.min(1))
        over = np.flatnonzero(self.bumped & (self.quiet_until <= now))
        for i in over:
            self.gate.bump(i, self.fault.clock(i, now), False, None)
            self.bumped[i] = False
        for i in np.flatnonzero(gap.min(1) <= 0.0):
            j = int(gap[i].argmin())
            normal = place[i, j] - inner[i, j]
            normal /= max(float(np.hypot(*normal)), 1e-9)
            kind = int(self.batch.circle_kind[i, j] if j < circles else self.batch.segment_kind[i, j - circles])
            if self.quiet_until[i] <= now:
                self._count(i, kind, normal, place[i, j], now)
            self.pose[i, :2] -= normal * (PULLED_CLEAR - gap[i, j])
            self.odometry[i, :2] += _turned(-normal * (PULLED_CLEAR - gap[i, j]), self.odometry[i, 2] - self.pose[i, 2])
            self.velocity[i] = 0.0
            if kind == PERSON:
                self.batch.turn_back(i, self.pose[i, :2])

    def _in_view(self, arm: np.ndarray, heading: float) -> bool:
        """True if a beam can hit a place that lies `arm` from base_link, world axes [m]. Cones can't place things."""
        place = _turned(arm, -heading)
        for source in self.robot.profile.sources:
            if source.cone:
                continue
            offset = place - source.origins
            away = np.arctan2(offset[:, 1], offset[:, 0]) - source.bearings
            if (np.abs(np.remainder(away + math.pi, math.tau) - math.pi) <= source.spread).any():
                return True
        return False

    def _count(self, i: int, kind: int, normal: np.ndarray, place: np.ndarray, now: float) -> None:
        heading = self.pose[i, 2]
        c, s = math.cos(heading), math.sin(heading)
        vx, vy, wz = self.velocity[i]
        arm = place - self.pose[i, :2]
        at_rim = np.array([c * vx - s * vy - wz * arm[1], s * vx + c * vy + wz * arm[0]])
        into = float(normal @ at_rim)
        if kind != PERSON and into <= MOVES_INTO:
            return  # set back from one thing into another
        if kind == PERSON and into <= DRIVES_INTO:
            self.out.walked_into[i] += 1
        else:
            self.out.hits[i, kind] += 1
            self.out.impact[i] += max(into, 0.0)
            self.out.hardest[i] = max(self.out.hardest[i], into)
        self.quiet_until[i] = now + QUIET
        bearing = math.remainder(math.atan2(arm[1], arm[0]) - heading, math.tau)
        if kind != PERSON or into > DRIVES_INTO:
            blind = not self._in_view(arm, heading)
            self.out.contacts.append(Contact(self.first + i, now, kind, bearing, max(into, 0.0), blind))
        if self.robot.bumpers is None:
            self.gate.bump(i, self.fault.clock(i, now), True, None)
        else:
            felt = min(self.robot.bumpers, key=lambda b: abs(math.remainder(b - bearing, math.tau)))
            if abs(math.remainder(felt - bearing, math.tau)) > math.radians(35.0):
                return
            self.gate.bump(i, self.fault.clock(i, now), True, felt)
        self.bumped[i] = True


def _integrate(pose: np.ndarray, velocity: np.ndarray, dt: float) -> None:
    heading = pose[:, 2] + 0.5 * velocity[:, 2] * dt
    c, s = np.cos(heading), np.sin(heading)
    pose[:, 0] += (velocity[:, 0] * c - velocity[:, 1] * s) * dt
    pose[:, 1] += (velocity[:, 0] * s + velocity[:, 1] * c) * dt
    pose[:, 2] += velocity[:, 2] * dt


def _turned(vector: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])
