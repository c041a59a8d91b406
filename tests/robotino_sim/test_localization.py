import math

import numpy as np

from robotino_sim.localization import Localization


def error(localization: Localization, x: float, y: float) -> float:
    return math.hypot(localization.estimate.x - x, localization.estimate.y - y)


def test_error_stays_while_standing_and_shrinks_while_driving():
    localization = Localization(np.random.default_rng(1))
    localization.update(1.0, 2.0, 0.5)
    begin = error(localization, 1.0, 2.0)
    assert begin > 0.05
    localization.update(1.0, 2.0, 0.5)
    assert error(localization, 1.0, 2.0) == begin
    for step in range(100):
        localization.update(1.0 + 0.05 * step, 2.0, 0.5)
    assert error(localization, 1.0 + 0.05 * 99, 2.0) < 0.01 * begin
    assert localization.estimate.seq == 102


def test_angles_stay_within_a_turn():
    localization = Localization(None)
    localization.update(0.0, 0.0, 3.0 * math.pi)
    assert -math.pi <= localization.estimate.phi <= math.pi


def test_driving_robot_finds_itself(stepped):
    stand = stepped("empty")
    stand.wait(0.2)
    before = stand.robot.snapshot().localization
    stand.drive(0.4, 0.0, 0.0, 5.0)
    x, y, *_ = stand.robot.truth()
    after = stand.robot.snapshot().localization
    assert math.hypot(after.x - x, after.y - y) < 0.3 * math.hypot(before.x, before.y)
