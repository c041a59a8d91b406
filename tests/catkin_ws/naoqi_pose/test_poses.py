from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from naoqi_pose.poses import UnusablePose, read_poses

from pepper_sim.body.description import LIMITS

SHIPPED = Path(__file__).resolve().parents[3] / "catkin_ws" / "src" / "naoqi_pose" / "config" / "pepper_poses.yaml"


def test_one_point_and_several_points():
    poses = read_poses(
        {
            "nod": {"joint_names": ["HeadPitch"], "positions": [[0.2], [0.0]], "time_from_start": [0.5, 1.0]},
            "look": {"joint_names": ["HeadYaw", "HeadPitch"], "positions": [0.5, 0], "time_from_start": 1},
        }
    )
    assert poses["nod"].points == [(0.5, [0.2]), (1.0, [0.0])]
    assert poses["look"].points == [(1.0, [0.5, 0.0])]


@pytest.mark.parametrize(
    ("pose", "complaint"),
    [
        ({"positions": [0.1], "time_from_start": 1}, "pose odd: 'joint_names' is missing"),
        ({"joint_names": ["A", "B"], "positions": [0.1], "time_from_start": 1}, "pose odd: 1 positions for 2 joints"),
        ({"joint_names": ["A"], "positions": ["x"], "time_from_start": 1}, "pose odd: could not convert"),
        ({"joint_names": ["A"], "positions": [[0.1]], "time_from_start": [1, 2]}, "pose odd: zip"),
    ],
)
def test_mistakes_name_the_pose(pose, complaint):
    with pytest.raises(UnusablePose, match=complaint):
        read_poses({"odd": pose})


def test_shipped_poses_are_within_the_joints_limits():
    poses = read_poses(yaml.safe_load(SHIPPED.read_text()))
    assert {"stand", "zero", "crouch", "arms_down"} <= set(poses)
    for name, pose in poses.items():
        for _, positions in pose.points:
            for joint, position in zip(pose.joint_names, positions, strict=True):
                limits = LIMITS[joint]
                # Recorded from a robot, so a joint may stand a trace beyond its documented limit.
                assert limits.lower - 0.02 <= position <= limits.upper + 0.02, (name, joint)
