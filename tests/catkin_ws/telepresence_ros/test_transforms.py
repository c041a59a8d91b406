"""The window's transforms when somebody sets the clock."""

import genpy
import pytest
from geometry_msgs.msg import TransformStamped
from telepresence_ros.transforms import HISTORY, Transforms
from tf2_msgs.msg import TFMessage

NOW = 1_000_000.0


def message(parent: str, child: str, stamp: float, x: float) -> TFMessage:
    transform = TransformStamped()
    transform.header.stamp, transform.header.frame_id, transform.child_frame_id = (
        genpy.Time.from_sec(stamp),
        parent,
        child,
    )
    transform.transform.translation.x, transform.transform.rotation.w = x, 1.0
    return TFMessage([transform])


@pytest.mark.parametrize("jump", [-3600.0, 3600.0])
def test_the_place_of_the_robot_is_known_after_the_clock_was_set(jump):
    told = {}
    transforms = Transforms("", lambda topic, kind, callback, method: told.update({topic: (callback, method)}))
    transforms.listen(True)

    def tell(topic, *words):
        callback, method = told[topic]
        callback(message(*words), method)

    tell("/tf_static", "base_link", "camera", NOW, 0.1)
    tell("/tf", "odom", "base_link", NOW, 1.0)
    for number in range(3):
        tell("/tf", "odom", "base_link", NOW + jump + number / 10, 2.0)
    _, place = transforms.place_of("camera", "odom", NOW + jump + 0.1)
    assert place.tolist() == pytest.approx([2.1, 0.0, 0.0])
    assert abs(jump) > HISTORY
