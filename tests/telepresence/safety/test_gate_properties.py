"""What holds for every scene, command and robot: properties of the gate, tried with random ones."""

import copy
import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telepresence.safety import PEPPER, ROBOTINO, ROBOTINO_LASER, Command, Odometry, State, VelocityGate
from telepresence.safety.braking import stopping_distance

PERIOD = 0.05
PROFILES = [ROBOTINO, ROBOTINO_LASER, PEPPER]
profiles = st.sampled_from(PROFILES)
speeds = st.floats(-1.0, 1.0)
anything = st.floats(allow_nan=True, allow_infinity=True)
not_numbers = st.sampled_from([math.nan, math.inf, -math.inf])
scenes = st.lists(st.tuples(st.floats(-math.pi, math.pi), st.floats(0.02, 0.6)), max_size=6)
"""Posts around the robot: bearing [rad], distance from the outline [m]."""


def readings(source, posts):
    """What the beams of a source return from posts 4 cm wide (n, 2) [m]."""
    ranges = np.full(source.beams, source.max_range)
    for post in posts:
        offset = post - source.origins
        along = (offset * source.directions).sum(axis=1)
        across = np.abs(offset[:, 0] * source.directions[:, 1] - offset[:, 1] * source.directions[:, 0])
        hit = (along > source.min_range) & (across < 0.02)
        ranges[hit] = np.minimum(ranges[hit], along[hit])
    return ranges


def posts_of(profile, scene):
    bearings = np.array([bearing for bearing, _ in scene])
    gaps = np.array([gap for _, gap in scene])
    if not len(scene):
        return np.empty((0, 2))
    reach = profile.outline.reach(bearings) + gaps
    return reach[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)


def decide(profile, scene, command, ticks=12, scans=None):
    """The last decision of a robot that stands in a scene and is commanded all the time."""
    gate, posts = VelocityGate(profile), posts_of(profile, scene)
    for tick in range(ticks):
        now = (1 + tick) * PERIOD
        for source in profile.sources:
            gate.update_ranges(source.name, now, readings(source, posts) if scans is None else scans[source.name])
        decision = gate.step(now, Command(*command, now), Odometry(0.0, 0.0, 0.0, now))
    return decision


@given(profiles, scenes, speeds, speeds, st.floats(-3.0, 3.0))
@settings(max_examples=30)
def test_output_is_finite_and_no_faster_than_command_and_limits(profile, scene, vx, vy, wz):
    decision = decide(profile, scene, (vx, vy, wz))
    limits = profile.limits
    assert all(map(math.isfinite, (decision.vx, decision.vy, decision.wz)))
    assert decision.speed <= min(math.hypot(vx, vy), limits.max_speed) + 1e-9
    assert abs(decision.wz) <= min(abs(wz), limits.max_turn) + 1e-9
    assert decision.wz * wz >= 0.0
    assert decision.vx * vx + decision.vy * vy >= -1e-9
    assert np.isfinite(decision.allowed).all() and (decision.allowed >= 0.0).all()
    assert (decision.allowed <= limits.max_speed + 1e-9).all()


@given(profiles, scenes, speeds, speeds)
@settings(max_examples=30)
def test_never_towards_a_seen_point_inside_the_stopping_distance(profile, scene, vx, vy):
    """Rolled on to a standstill, the outline touches nothing that a beam has hit."""
    decision = decide(profile, scene, (vx, vy, 0.0))
    limits, speed = profile.limits, decision.speed
    if speed < 1e-6:
        return
    posts = posts_of(profile, scene)
    seen = np.concatenate(
        [
            source.origins[hit] + ranges[hit, None] * source.directions[hit]
            for source in profile.sources
            if not source.cone
            for ranges in [readings(source, posts)]
            for hit in [(ranges < source.max_range) & (ranges >= source.min_range)]
        ]
    )
    gap = profile.outline.measure(seen)[0]
    seen = seen[gap > 0.0]
    way = np.linspace(0.0, stopping_distance(speed, limits.reaction, limits.braking), 20)
    for step in way[:, None] * np.array([decision.vx, decision.vy]) / speed:
        assert (profile.outline.measure(seen - step)[0] > 0.0).all()


@given(scenes, speeds, speeds, speeds)
@settings(max_examples=30)
def test_mirrored_scene_and_command_give_the_mirrored_output(scene, vx, vy, wz):
    # One tick, on which nothing depends on the order in which points were found.
    left = decide(ROBOTINO, scene, (vx, vy, wz), ticks=2)
    right = decide(ROBOTINO, [(-bearing, gap) for bearing, gap in scene], (vx, -vy, -wz), ticks=2)
    assert (right.vx, right.vy, right.wz) == pytest.approx((left.vx, -left.vy, -left.wz), abs=1e-6)
    assert right.allowed == pytest.approx(np.roll(left.allowed[::-1], 1), abs=1e-6)


@given(scenes, speeds, speeds, st.integers(1, 8))
@settings(max_examples=30)
def test_scene_and_command_turned_by_whole_beams_turn_the_output(scene, vx, vy, times):
    angle = times * math.tau / 9
    c, s = math.cos(angle), math.sin(angle)
    command = (c * vx - s * vy, s * vx + c * vy, 0.0)
    before = decide(ROBOTINO, scene, (vx, vy, 0.0), ticks=2)
    after = decide(ROBOTINO, [(bearing + angle, gap) for bearing, gap in scene], command, ticks=2)
    turned = (c * before.vx - s * before.vy, s * before.vx + c * before.vy)
    assert (after.vx, after.vy) == pytest.approx(turned, abs=1e-6)


@given(profiles, st.integers(0, 3), not_numbers)
@settings(max_examples=30)
def test_a_command_that_is_not_a_number_stops_the_robot(profile, place, value):
    command = [0.1, 0.1, 0.1, PERIOD * 3]
    command[place] = value
    gate = moving(profile)
    decision = gate.step(PERIOD * 31, Command(*command), Odometry(0.0, 0.0, 0.0, PERIOD * 31))
    assert (decision.vx, decision.vy, decision.wz) == (0.0, 0.0, 0.0)
    assert decision.state is State.FAULT and "not a number" in decision.reason


@given(profiles, st.integers(0, 3), not_numbers)
@settings(max_examples=30)
def test_odometry_that_is_not_a_number_stops_the_robot(profile, place, value):
    pose = [0.0, 0.0, 0.0, PERIOD * 31]
    pose[place] = value
    decision = moving(profile).step(PERIOD * 31, Command(0.1, 0.0, 0.0, PERIOD * 31), Odometry(*pose))
    assert (decision.vx, decision.vy, decision.wz) == (0.0, 0.0, 0.0)
    assert decision.state is State.FAULT


@given(profiles, not_numbers, st.data())
@settings(max_examples=30)
def test_one_reading_that_is_not_a_number_stops_the_robot(profile, value, data):
    source = data.draw(st.sampled_from(profile.sources))
    ranges = np.full(source.beams, source.max_range)
    ranges[data.draw(st.integers(0, source.beams - 1))] = value
    gate, now = moving(profile), PERIOD * 31
    assert not gate.update_ranges(source.name, now, ranges)
    decision = gate.step(now, Command(0.1, 0.0, 0.0, now), Odometry(0.0, 0.0, 0.0, now))
    assert (decision.vx, decision.vy, decision.wz) == (0.0, 0.0, 0.0)
    assert decision.state is State.SENSOR_STALE and source.name in decision.reason


@given(st.lists(st.tuples(anything, anything, anything), min_size=1, max_size=5), anything, anything)
@settings(max_examples=30)
def test_garbage_never_raises_and_never_comes_out(commands, reading, clock):
    gate = moving(ROBOTINO)
    for number, command in enumerate(commands):
        now = PERIOD * (31 + number)
        gate.update_ranges("infrared", now, [reading] * 9, stamp=clock)
        gate.update_ranges("infrared", now, [reading])
        decision = gate.step(now, Command(*command, now), Odometry(0.0, 0.0, 0.0, now))
        assert all(map(math.isfinite, (decision.vx, decision.vy, decision.wz)))
        assert decision.speed <= ROBOTINO.limits.max_speed + 1e-9
    decision = gate.step(clock, Command(0.1, 0.0, 0.0, clock), Odometry(0.0, 0.0, 0.0, clock))
    assert all(map(math.isfinite, (decision.vx, decision.vy, decision.wz)))


def moving(profile):
    """A gate that has let a robot drive in empty space for 30 ticks."""
    return copy.deepcopy(_moved(profile.name))


@cache
def _moved(name):
    profile = next(profile for profile in PROFILES if profile.name == name)
    gate = VelocityGate(profile)
    for tick in range(1, 31):
        now = tick * PERIOD
        for source in profile.sources:
            gate.update_ranges(source.name, now, [source.max_range] * source.beams)
        decision = gate.step(now, Command(0.1, 0.0, 0.0, now), Odometry(0.0, 0.0, 0.0, now))
    assert decision.vx > 0.09
    return gate
