"""A late picture is told from a robot whose clock is another one."""

import math

import pytest

from gui.driving.picture_age import SURE_AFTER, PictureAge

TODAY = 1.8e9
"""[s since 1970]"""


def ages(age, *of_pictures):
    """What `age` makes of pictures that come every 0.1 s and are so old [s]."""
    return [age.of(TODAY + 0.1 * n - old, TODAY + 0.1 * n, 0.1 * n) for n, old in enumerate(of_pictures)]


@pytest.mark.parametrize("old", [0.1, 2.0, 4.9, 5.1, 30.0, 3600.0])
def test_a_picture_is_late_however_late_it_is_once_the_clocks_have_agreed(old):
    age = PictureAge()
    assert ages(age, 0.1, old, old) == pytest.approx([0.1, old, old])
    assert not age.clocks_differ(100.0)


@pytest.mark.parametrize("old", [-2.0, 30.0])
def test_the_age_is_unknown_where_the_clocks_have_never_agreed(old):
    age = PictureAge()
    assert all(math.isnan(one) for one in ages(age, old, old, old))
    assert not age.clocks_differ(SURE_AFTER - 0.1) and age.clocks_differ(SURE_AFTER)


def test_what_had_waited_in_a_buffer_when_the_feed_began_says_nothing_about_the_clocks():
    age = PictureAge()
    assert ages(age, 9.0, 0.1, 9.0)[1:] == pytest.approx([0.1, 9.0])
    assert not age.clocks_differ(100.0)


def test_a_picture_of_the_future_is_not_old():
    age = PictureAge()
    assert math.isnan(ages(age, 0.1, -0.1)[1])


def test_another_feed_may_have_another_clock():
    age = PictureAge()
    ages(age, 0.1)
    age.begin()
    assert math.isnan(age.of(TODAY - 30.0, TODAY, 50.0)) and not age.clocks_differ(50.0)
    assert age.clocks_differ(50.0 + SURE_AFTER)
