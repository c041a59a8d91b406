"""Pilots of the safety benchmark. They drive from goal to goal with keys, through a camera, and see late.

A reckless pilot goes straight for the goal. The others steer around what they see, and overlook one thing in six;
what they see is up to 500 ms old. All but half of the reckless ones look where they drive: they turn by tapping keys,
with a reaction time, and so overshoot. The other half drive sideways without turning, as an omni-directional base can.
"""

from __future__ import annotations

import math

import numpy as np
from safety.worlds import GOALS, NOWHERE, Batch

PILOTS = ("reckless", "careful", "late 100 ms", "late 300 ms", "late 500 ms")
DELAYS = (0.0, 0.0, 0.1, 0.3, 0.5)
"""Delay of the link, to and fro [s]."""
REACTION = 0.15
"""Reaction time of the person [s]."""
PERIOD = 0.1
"""Keyboards repeat at 10 Hz [s]."""
ARRIVED = 0.30
"""[m]"""
PATIENCE = 2.0
"""A pilot who has asked to drive for this long without getting on tries another goal [s]."""
GETS_ON = 0.10
"""Having come this far is getting on [m]."""
OVERLOOKED = 1.0 / 6.0
TURN_IN_PLACE = math.radians(60.0)
DEAD_BAND = math.radians(8.0)
SIDEWAYS = np.radians([0, 15, -15, 30, -30, 45, -45, 60, -60, 80, -80, 100, -100])
"""Directions next to the goal's that a pilot considers, best first [rad]."""


class Pilots:
    """One pilot per place; kinds alternate."""

    def __init__(self, batch: Batch, first: int, speed: float, robot_radius: float, seed: int) -> None:
        """
        Args:
            first: Number of the first place; the kind of pilot depends on it.
            speed: Driving speed [m/s].
        """
        count = len(batch)
        rng = np.random.default_rng([seed, 11])
        numbers = first + np.arange(count)
        self.kind = numbers % len(PILOTS)
        self.sideways = (self.kind == 0) & (numbers // len(PILOTS) % 2 == 0)
        self.delay = np.array(DELAYS)[self.kind]
        self._batch = batch
        self._speed = speed
        self._turn_rate = rng.uniform(0.4, 1.0, count)
        self._room = robot_radius + 0.10 + 0.05 * rng.standard_normal(count)
        self._turning = np.zeros(count)
        self._goal = np.zeros(count, int)
        self._pushing = np.zeros(count)
        self._was = batch.start[:, :2].copy()
        self.reached = np.zeros(count, int)
        things = np.concatenate([batch.circle[..., :2], _wall_points(batch)], axis=1)
        self._seen = rng.random(things.shape[:2]) >= OVERLOOKED
        self._walls = _wall_points(batch)

    @property
    def goal(self) -> np.ndarray:
        """(S, 2) [m]."""
        return self._batch.goals[np.arange(len(self._goal)), self._goal % GOALS]

    def decide(self, pose: np.ndarray, circles: np.ndarray, true_pose: np.ndarray) -> np.ndarray:
        """Commands (S, 3) for what the pilots see; call it every PERIOD.

        Args:
            pose: (S, 3) as seen, late.
            circles: (S, C, 3) as seen, late.
            true_pose: For judging whether the goal is reached.
        """
        away = self.goal - true_pose[:, :2]
        there = np.sqrt((away**2).sum(1)) < ARRIVED
        moved = np.sqrt(((true_pose[:, :2] - self._was) ** 2).sum(1)) > GETS_ON
        tired = self._pushing > PATIENCE
        self.reached += there
        self._goal += there | tired
        on = there | tired | moved
        self._was = np.where(on[:, None], true_pose[:, :2], self._was)

        way = self.goal - pose[:, :2]
        bearing = np.arctan2(way[:, 1], way[:, 0])
        bearing += np.where(self.kind == 0, 0.0, self._detour(pose, bearing, circles))
        error = _wrap(bearing - pose[:, 2])
        commands = np.zeros((len(pose), 3))
        commands[:, 0] = self._speed * np.cos(error)
        commands[:, 1] = self._speed * np.sin(error)
        # Keys: turn from the dead band on until the error has changed sign; drive once roughly aligned.
        start = np.abs(error) > DEAD_BAND
        done = error * self._turning <= 0.0
        self._turning = np.where(start, np.sign(error), np.where(done, 0.0, self._turning))
        steer = ~self.sideways
        commands[steer, 0] = np.where(np.abs(error) < TURN_IN_PLACE, self._speed, 0.0)[steer]
        commands[steer, 1] = 0.0
        commands[steer, 2] = (self._turning * self._turn_rate)[steer]
        drives = (commands[:, :2] != 0.0).any(1)
        self._pushing = np.where(on, 0.0, self._pushing + PERIOD * drives)
        return commands

    def _detour(self, pose: np.ndarray, bearing: np.ndarray, circles: np.ndarray) -> np.ndarray:
        """Angle to add so that the next 1.2 m look free (S,) [rad]."""
        things = np.concatenate([circles[..., :2], self._walls], axis=1)
        radius = np.concatenate([circles[..., 2], np.zeros(self._walls.shape[:2])], axis=1)
        offset = things - pose[:, None, :2]
        matters = self._seen & ((offset**2).sum(2) < 2.0**2)
        direction = bearing[:, None] + SIDEWAYS  # (S, K)
        ux, uy = np.cos(direction)[..., None], np.sin(direction)[..., None]
        along = offset[:, None, :, 0] * ux + offset[:, None, :, 1] * uy
        across = np.abs(offset[:, None, :, 0] * uy - offset[:, None, :, 1] * ux)
        inside = (across < self._room[:, None, None] + radius[:, None]) & (along > 0.0) & matters[:, None]
        free = np.where(inside, along, NOWHERE).min(2)
        enough = free > 1.2
        first = np.where(enough.any(1), enough.argmax(1), free.argmax(1))
        return SIDEWAYS[first]


def _wall_points(batch: Batch) -> np.ndarray:
    """Walls and sides of boxes as seen by a pilot: 20 points each, (S, 20 W, 2) [m]."""
    share = np.linspace(0.0, 1.0, 20)[:, None]
    a, b = batch.segment[:, :, None, :2], batch.segment[:, :, None, 2:]
    return (a + share * (b - a)).reshape(len(batch), -1, 2)


def _wrap(angle: np.ndarray) -> np.ndarray:
    return np.remainder(angle + math.pi, math.tau) - math.pi
