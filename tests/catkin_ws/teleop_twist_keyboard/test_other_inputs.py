"""Which commands of other nodes the keyboard gives way to."""

import pytest
from twist_keyboard.other_inputs import NEWCOMER_SILENCE, STOP_SILENCE, OtherInputs


@pytest.fixture
def inputs():
    return OtherInputs()


@pytest.mark.parametrize("moves", [True, False])
def test_who_has_been_silent_takes_over(inputs, moves):
    assert inputs.take_over("/joystick", moves, 0.0)
    assert inputs.take_over("/joystick", moves, NEWCOMER_SILENCE + 0.01)


def test_a_key_drives_beside_what_goes_on(inputs):
    """Pressed after the other input had begun: who began last drives."""
    inputs.take_over("/drive_lease", True, 0.0)
    assert not any(inputs.take_over("/drive_lease", True, 0.05 * step) for step in range(1, 40))


def test_a_joystick_that_nobody_touches_stops_nothing(inputs):
    inputs.take_over("/joystick", False, 0.0)
    assert not any(inputs.take_over("/joystick", False, 0.1 * step) for step in range(1, 40))


def test_letting_go_elsewhere_stops_the_keyboard_too(inputs):
    inputs.take_over("/drive_lease", True, 0.0)
    assert inputs.take_over("/drive_lease", False, 0.05)


def test_each_press_of_stop_counts_however_often_it_is_pressed(inputs):
    inputs.take_over("/drive_lease", False, 0.0)
    assert all(inputs.take_over("/drive_lease", False, (STOP_SILENCE + 0.1) * press) for press in range(1, 6))
