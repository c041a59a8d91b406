"""Outlines and sonar echoes."""

import math

import numpy as np
import pytest

from telepresence.safety import PEPPER, Outline
from telepresence.safety.scan import scan_of_ranges
from telepresence.safety.sonar import Echoes

SONAR = PEPPER.source("front sonar")


def test_a_disc_measures_distances_from_its_rim():
    distance, normals, levers = Outline.disc(0.2).measure(np.array([[0.5, 0.0], [0.0, -0.1]]))
    assert distance == pytest.approx([0.3, -0.1])
    assert normals == pytest.approx(np.array([[1.0, 0.0], [0.0, -1.0]]))
    assert levers == pytest.approx([0.0, 0.0])


def test_a_polygon_knows_which_way_turning_brings_it_nearer():
    box = Outline(((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)), 0.05)
    distance, _, levers = box.measure(np.array([[0.10, 0.30], [-0.10, 0.30]]))
    assert distance == pytest.approx([0.15, 0.15])
    assert levers == pytest.approx([0.1, -0.1])
    assert box.reach(np.array([0.0, 0.25 * math.pi])) == pytest.approx([0.15, 0.1 * math.sqrt(2.0) + 0.05], abs=1e-5)


@pytest.mark.parametrize(("vertices", "radius"), [((), 0.1), (((0.0, 0.0),), 0.0), (((0, 0), (0, 1), (1, 0)), 0.1)])
def test_an_outline_that_makes_no_sense_is_refused(vertices, radius):
    with pytest.raises(ValueError):
        Outline(vertices, radius)


def test_an_echo_counts_only_if_nothing_known_explains_it():
    echoes, scan = Echoes(), scan_of_ranges(SONAR, np.array([1.0]))
    echoes.observe(SONAR, scan, np.empty((0, 2)))
    (echo,) = echoes
    assert echo.place == pytest.approx(SONAR.origins[0] + [1.0, 0.0])
    post = SONAR.origins[0] + 1.02 * np.array([math.cos(0.4), math.sin(0.4)])
    echoes.observe(SONAR, scan, np.array([post]))
    assert not list(echoes)
    echoes.observe(SONAR, scan, np.array([SONAR.origins[0] + [0.5, 0.0]]))
    assert len(list(echoes)) == 1
    echoes.observe(SONAR, scan_of_ranges(SONAR, np.array([SONAR.max_range])), np.empty((0, 2)))
    assert not list(echoes)
