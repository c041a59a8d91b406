"""Where the parts of a body are, from its URDF and its joints."""

import numpy as np
import pytest
import rospy
from hypothesis import given
from hypothesis import strategies as st
from telepresence_ros.robot_state import BodyState, from_roll_pitch_yaw, product, read_joints, rotated

ARM = """<robot name="arm">
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.1 0.2 0.3" rpy="1.5707963 0 0"/><axis xyz="0 0 2"/></joint>
  <joint name="slide" type="prismatic"><parent link="lower"/><child link="finger"/>
    <origin rpy="0 0 1.5707963"/><axis xyz="1 0 0"/></joint>
  <joint name="thumb" type="continuous"><parent link="lower"/><child link="thumb"/><axis xyz="0 1 0"/>
    <mimic joint="elbow" multiplier="-2" offset="0.5"/></joint>
  <joint name="cover" type="fixed"><parent link="lower"/><child link="cover"/><origin xyz="0 0 1"/></joint>
  <joint name="loose" type="floating"><parent link="lower"/><child link="loose"/></joint>
</robot>"""
ANGLES = st.floats(-7.0, 7.0)


def matrix(roll, pitch, yaw):
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in (roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


@given(st.tuples(ANGLES, ANGLES, ANGLES), st.tuples(ANGLES, ANGLES, ANGLES))
def test_quaternions_turn_as_matrices_do(first, second):
    together = product(from_roll_pitch_yaw(*first), from_roll_pitch_yaw(*second))
    for vector in np.eye(3):
        expected = matrix(*first) @ matrix(*second) @ vector
        assert rotated(together, vector) == pytest.approx(expected, abs=1e-9)


def test_joints_turn_slide_and_follow():
    stamp = rospy.Time(5)
    body = BodyState(read_joints(ARM))
    found = {m.child_frame_id: m for m in body.moving({"elbow": 0.6, "slide": 0.05, "unknown": 1.0}, stamp)}
    assert set(found) == {"lower", "finger", "thumb"}
    elbow = found["lower"]
    assert elbow.header.frame_id == "upper" and elbow.header.stamp == stamp
    assert [getattr(elbow.transform.translation, i) for i in "xyz"] == [0.1, 0.2, 0.3]
    turned = np.array([getattr(elbow.transform.rotation, i) for i in "xyzw"])
    assert rotated(turned, np.array([1.0, 0, 0])) == pytest.approx([np.cos(0.6), 0, np.sin(0.6)], abs=1e-6)
    slid = found["finger"].transform.translation
    assert [slid.x, slid.y, slid.z] == pytest.approx([0, 0.05, 0], abs=1e-6)
    thumb = found["thumb"].transform.rotation
    assert 2 * np.arctan2(thumb.y, thumb.w) == pytest.approx(0.5 - 2 * 0.6)
    assert [m.child_frame_id for m in body.fixed] == ["cover"]


def test_what_is_no_number_moves_nothing():
    assert BodyState(read_joints(ARM)).moving({"slide": float("nan")}, rospy.Time(5)) == []


@pytest.mark.parametrize("text", ["", "<robot", "<world/>", "<robot><joint name='a' type='fixed'/></robot>"])
def test_what_is_no_urdf_is_refused(text):
    with pytest.raises(ValueError, match="robot_description"):
        read_joints(text)


@pytest.mark.ros
def test_a_prefix_that_the_drivers_do_not_use_splits_no_tree(graph):
    graph.run("rosparam", "set", "/p/robot_description", ARM).process.wait(30)
    graph.run("rosparam", "set", "/p/tf_prefix", "left").process.wait(30)
    probe = graph.probe()
    probe.watch("/tf_static", "tf2_msgs/TFMessage", ["transforms.0.header.frame_id", "transforms.0.child_frame_id"])
    with graph.run(str(graph.workspace / "lib/telepresence_ros/robot_state_publisher"), "__ns:=/p") as publisher:
        publisher.wait_for("tf_prefix is not used; .*tf:=/left/tf")
        assert probe.newest("/tf_static") == ["lower", "cover"]
