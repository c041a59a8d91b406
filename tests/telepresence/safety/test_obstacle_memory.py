"""What is remembered, for how long, and what takes it back."""

import math

import numpy as np
import pytest

from telepresence.safety import ROBOTINO
from telepresence.safety.obstacle_memory import CAPACITY, FIRST_LIFETIME, Moment, ObstacleMemory
from telepresence.safety.scan import scan_of_ranges

SOURCE = ROBOTINO.sources[0]
HERE = np.zeros(2)


def scan(ahead):
    return scan_of_ranges(SOURCE, np.array([ahead, *[SOURCE.max_range] * 8]))


def see(memory, ahead, now):
    memory.integrate(scan(ahead), HERE, Moment(now, now, 0.0))
    memory.limit(HERE, Moment(now, now, 0.0))


def test_a_return_is_remembered_where_it_was():
    memory = ObstacleMemory(30.0)
    see(memory, 0.20, 0.0)
    assert memory.points == pytest.approx(np.array([[0.2264 + 0.20, 0.0]]))


def test_noise_is_averaged_into_one_obstacle():
    memory = ObstacleMemory(30.0)
    for tick, noise in enumerate((0.0, 0.02, -0.02, 0.01, -0.01)):
        see(memory, 0.20 + noise, 0.05 * tick)
    assert len(memory) == 1 and memory.sightings[0] == 5
    assert memory.points[0, 0] == pytest.approx(0.4264, abs=0.01)


def test_a_single_sighting_fades_soon_a_firm_one_late():
    once, often = ObstacleMemory(30.0), ObstacleMemory(30.0)
    see(once, 0.20, 0.0)
    for tick in range(8):
        see(often, 0.20, 0.05 * tick)
    for memory, last in ((once, 0.0), (often, 0.35)):
        memory.limit(HERE, Moment(last + FIRST_LIFETIME - 0.1, last + FIRST_LIFETIME - 0.1, 0.0))
        assert len(memory) == 1
    once.limit(HERE, Moment(FIRST_LIFETIME + 0.1, FIRST_LIFETIME + 0.1, 0.0))
    often.limit(HERE, Moment(29.0, 29.0, 0.0))
    assert (len(once), len(often)) == (0, 1)
    often.limit(HERE, Moment(31.0, 31.0, 0.0))
    assert len(often) == 0


def test_only_several_beams_through_its_place_take_an_obstacle_back():
    memory = ObstacleMemory(30.0)
    for tick in range(5):
        see(memory, 0.15, 0.05 * tick)
    for tick in range(3):
        see(memory, SOURCE.max_range, 0.3 + 0.05 * tick)
    assert len(memory) == 1
    see(memory, SOURCE.max_range, 0.5)
    assert len(memory) == 0


def test_a_beam_that_passes_beside_takes_nothing_back():
    memory = ObstacleMemory(30.0)
    see(memory, 0.15, 0.0)
    turned = scan(SOURCE.max_range).seen_from(0.0, 0.0, math.radians(10.0))
    for _ in range(8):
        memory.integrate(turned, HERE, Moment(0.1, 0.1, 0.0))
    memory.limit(HERE, Moment(0.1, 0.1, 0.0))
    assert len(memory) == 1


def test_what_was_felt_stays_for_its_own_time():
    memory = ObstacleMemory(30.0)
    memory.add(np.array([[0.25, 0.0]]), Moment(0.0, 0.0, 0.0), 60.0)
    memory.limit(HERE, Moment(59.0, 59.0, 0.0))
    assert len(memory) == 1
    memory.limit(HERE, Moment(61.0, 61.0, 0.0))
    assert len(memory) == 0


def test_the_nearest_are_kept_when_there_are_too_many():
    memory = ObstacleMemory(30.0)
    rng = np.random.default_rng(1)
    memory.add(rng.uniform(-1.0, 1.0, (3 * CAPACITY, 2)), Moment(0.0, 0.0, 0.0), 60.0)
    farthest = np.sort(np.hypot(*memory.points.T))[CAPACITY - 1]
    memory.limit(HERE, Moment(0.0, 0.0, 0.0))
    assert len(memory) == CAPACITY
    assert np.hypot(*memory.points.T).max() == pytest.approx(farthest)
