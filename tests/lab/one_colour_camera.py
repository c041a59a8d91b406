"""A node whose camera sees one colour."""

from __future__ import annotations

_NODE = """
import rospy, numpy
from sensor_msgs.msg import Image
from telepresence.video.images import fill_image_message
rospy.init_node("robot")
publisher = rospy.Publisher("{topic}", Image, queue_size=1)
pixels = numpy.full((240, 320, 3), {colour}, numpy.uint8)
while not rospy.is_shutdown():
    publisher.publish(fill_image_message(Image(), pixels, "rgb8"))
    rospy.rostime.wallsleep(0.05)
"""


def publish_colour(graph, topic: str, colour: tuple[int, int, int]):
    """Start it on a graph of `tests/catkin_ws/conftest.py`: 320x240 pictures of this RGB colour, 20 a second."""
    return graph.run("python3", "-c", _NODE.format(topic=topic, colour=colour))
