from __future__ import annotations

from telepresence.drive.pace import Pace


def test_a_few_go_at_once_and_many_at_the_period():
    pace, now, gone = Pace(0.02, 3), 10.0, []
    while now < 11.0:
        now = max(now, pace.due())
        pace.take(now)
        gone.append(now)
    assert gone[:3] == [10.0] * 3, "after a pause three go at once"
    assert gone[3] == 10.02 and len(gone) in (52, 53, 54), "then one in a period"
    assert pace.due() > 10.99
    assert pace.due() <= 20.0, "after a pause it is due"
    pace.take(20.0)
    pace.take(20.0)
    assert pace.due() <= 20.0, "and so is the third"
