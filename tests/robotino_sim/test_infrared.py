"""The tables below are copied from the sources once more: one shared table would agree with itself even if wrong."""

import numpy as np
import pytest

from robotino_sim.infrared import reading, spot_distance, voltage

API2_VOLTS = (0.30, 0.39, 0.41, 0.50, 0.75, 0.80, 0.95, 1.05, 1.30, 1.40, 1.55, 1.80, 2.35, 2.55)
API2_METRES = (0.41, 0.35, 0.30, 0.25, 0.18, 0.16, 0.14, 0.12, 0.10, 0.09, 0.08, 0.07, 0.05, 0.04)
SHARP = {0.03: 3.03, 0.04: 2.72, 0.07: 1.76, 0.10: 1.25, 0.16: 0.82, 0.20: 0.66, 0.25: 0.53, 0.30: 0.42, 0.40: 0.31}


@pytest.mark.parametrize(("volts", "metres"), list(zip(API2_VOLTS, API2_METRES, strict=True)))
def test_readings_of_the_vendors_table(volts, metres):
    assert reading(volts) == pytest.approx(metres)


@pytest.mark.parametrize(("metres", "volts"), list(SHARP.items()))
def test_voltages_of_the_sensors_table(metres, volts):
    assert voltage(metres) == pytest.approx(volts)


def test_readings_never_leave_their_range():
    readings = reading(voltage(np.concatenate([np.linspace(0.0, 2.0, 4001), [np.inf]])))
    assert readings.min() >= 0.04
    assert readings.max() == 0.41
    assert reading(voltage(np.inf)) == 0.41


def test_error_of_both_tables_together_is_a_centimetre_or_two():
    distances = np.linspace(0.045, 0.30, 200)
    assert np.abs(reading(voltage(distances)) - distances).max() < 0.02


def test_contact_reads_farther_than_it_is():
    assert reading(voltage(0.005)) > 0.08
    assert reading(voltage(0.032)) == 0.04


def test_spot_on_a_slanting_wall_is_the_middle_of_the_beam():
    assert spot_distance(np.array([[0.20, 0.19, 0.21, 0.201, 0.201]])) == 0.20


@pytest.mark.parametrize("behind", [np.inf, 0.38])
def test_thin_leg_at_the_edge_of_the_beam_counts_fully(behind):
    assert spot_distance(np.array([[behind, behind, 0.1, behind, behind]])) == pytest.approx(0.1)


def test_a_wall_outshines_a_leg_just_before_it():
    assert spot_distance(np.array([[0.38, 0.38, 0.33, 0.38, 0.38]])) == pytest.approx(0.38)


def test_nothing_is_seen_in_an_empty_room():
    assert np.all(np.isinf(spot_distance(np.full((9, 5), np.inf))))
