"""A slow link drives slowly, a very slow one not at all."""

import math

from gui.driving.delay_speed_limit import FORGET_AFTER, DelaySpeedLimit


def noted(*, command=(), picture=()):
    """A delay every 0.1 s; the last one at 0."""
    cap = DelaySpeedLimit()
    for note, delays in ((cap.note_command, command), (cap.note_picture, picture)):
        for index, delay in enumerate(delays):
            note(delay, 0.1 * (index + 1 - len(delays)))
    return cap


def test_the_share_falls_with_the_greater_delay():
    assert DelaySpeedLimit().share(0.0) == 1.0, "nothing is known"
    assert noted(command=[0.4] * 6, picture=[0.3] * 6).share(0.0) == 1.0
    assert noted(command=[0.6] * 6, picture=[0.3] * 6).share(0.0) == 0.5
    assert noted(command=[0.1] * 6, picture=[0.6] * 6).share(0.0) == 0.5
    assert noted(command=[1.1] * 6).share(0.0) == 0.0
    assert noted(picture=[1.1] * 6).share(0.0) == 0.0


def test_one_late_message_caps_nothing():
    assert noted(command=[0.1] * 5 + [2.0]).share(0.0) == 1.0
    cap = noted(picture=[0.1])
    cap.note_picture(0.9, 1.0)
    assert cap.share(1.0) == 1.0, "the first after a pause"
    cap.note_picture(0.9, 1.1)
    assert cap.share(1.1) == 0.5


def test_clocks_that_disagree_say_nothing():
    assert noted(picture=[math.nan] * 6).share(0.0) == 1.0


def test_after_a_stop_the_first_commands_go_at_half_speed_until_one_is_answered_in_time():
    cap = noted(command=[1.5] * 6)
    assert cap.share(0.0) == 0.0
    later = FORGET_AFTER + 0.1
    assert cap.share(later) == 0.5, "there is nothing to measure, so it may be tried"
    cap.note_command(0.2, later + 0.1)
    assert cap.share(later + 0.1) == 1.0
