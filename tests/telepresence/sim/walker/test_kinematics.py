"""Joint angles and feet."""

from __future__ import annotations

import numpy as np

from telepresence.sim.walker.body import LIMITS
from telepresence.sim.walker.gait import STANCE
from telepresence.sim.walker.kinematics import JOINTS, SIDE, feet_at, joint_angles


def test_angles_put_the_feet_where_they_were_wanted():
    rng = np.random.default_rng(1)
    for _ in range(200):
        feet = STANCE + rng.uniform(-0.04, 0.04, (4, 3))
        assert np.allclose(feet_at(joint_angles(feet)), feet, atol=1e-9)


def test_the_standing_pose_is_within_the_joints_limits_with_the_knees_behind():
    angles = joint_angles(STANCE)
    for joint, name in enumerate(JOINTS):
        low, high = LIMITS[name]
        own = angles[:, joint] * (SIDE if name == "out" else 1.0)
        assert (own > low).all() and (own < high).all()
    assert (angles[:, 1] > 0.0).all() and (angles[:, 2] < 0.0).all()


def test_a_foot_out_of_reach_gives_a_stretched_or_folded_leg_and_no_error():
    for far in (5.0, 1e-9):
        angles = joint_angles(STANCE * (1.0, 1.0, far))
        assert np.isfinite(angles).all() and np.isfinite(feet_at(angles)).all()
