"""How long the next picture may take follows how often they come."""

import pytest

from gui.widgets.picture_patience import FEWEST, LEAST_PATIENCE, MOST_PATIENCE, PERIODS, REMEMBERED, PicturePatience


def noted(*periods):
    patience, now = PicturePatience(), 100.0
    patience.note(now)
    for period in periods:
        now += period
        patience.note(now)
    return patience.seconds()


@pytest.mark.parametrize("rate", [30.0, 20.0, 15.0, 8.0, 4.0, 1.0])
def test_it_lasts_for_a_few_periods_within_bounds(rate):
    wanted = min(MOST_PATIENCE, max(LEAST_PATIENCE, PERIODS / rate))
    assert noted(*[1.0 / rate] * 5) == pytest.approx(wanted)


def test_while_the_period_is_unknown_it_is_long():
    assert PicturePatience().seconds() == noted(*[0.05] * (FEWEST - 1)) == MOST_PATIENCE


def test_one_interruption_changes_nothing_and_a_slower_link_does():
    assert noted(*[0.05] * 4, 0.9, *[0.05] * 2) == LEAST_PATIENCE
    assert noted(*[0.05] * REMEMBERED, *[0.35] * 5) == pytest.approx(PERIODS * 0.35)


def test_other_pictures_have_another_period():
    patience = PicturePatience()
    for number in range(REMEMBERED):
        patience.note(0.05 * number)
    patience.forget()
    assert patience.seconds() == MOST_PATIENCE
    patience.note(1.0)
    patience.note(1.5)
    assert patience.seconds() == MOST_PATIENCE
