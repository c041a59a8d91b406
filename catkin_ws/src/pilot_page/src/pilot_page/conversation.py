"""Sound both ways with one robot, the pilot's face on its tablet, and what it says: topics of its namespace.

Publishes:  voice/from_pilot (telepresence_msgs/Sound), com_cam/face (sensor_msgs/CompressedImage), speech
            (std_msgs/String).
Subscribes: voice/from_robot (telepresence_msgs/Sound), while somebody listens.
"""

from __future__ import annotations

from collections.abc import Callable

import rospy
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import String
from telepresence_msgs.msg import Sound

from telepresence.page.shared_sound import Take
from telepresence.teleop.lease_messages import Account


class Conversation:
    """See `telepresence.page.station.Conversation`. What no program of the robot takes cannot be had.

    Args:
        topic: Returns the full name of one of the robot's topics.
    """

    def __init__(self, topic: Callable[[str], str]) -> None:
        self._topic = topic
        self._voice = rospy.Publisher(topic("voice/from_pilot"), Sound, queue_size=20, tcp_nodelay=True)
        self._face = rospy.Publisher(topic("com_cam/face"), CompressedImage, queue_size=1, tcp_nodelay=True)
        self._speech = rospy.Publisher(topic("speech"), String, queue_size=10)
        self._state = rospy.Subscriber(topic("voice/state"), String, lambda _message: None, queue_size=1)
        self._robot: rospy.Subscriber | None = None

    def listen(self, take: Take | None) -> None:
        """Hand the robot's sound to `take`, or to nobody."""
        if self._robot is not None:
            self._robot.unregister()
            self._robot = None
        if take is not None:
            self._robot = rospy.Subscriber(
                self._topic("voice/from_robot"),
                Sound,
                lambda message: take(message.data, message.rate, message.channels),
                queue_size=10,
                tcp_nodelay=True,
            )

    def speak(self, frames: bytes, rate: int, channels: int) -> None:
        """Let the robot play a piece of the pilot's voice."""
        self._voice.publish(Sound(rate, channels, frames))

    def show_face(self, jpeg: bytes | None) -> None:
        """Show a picture on the tablet; com_cam shows the tablet's page while any come."""
        if jpeg is None:
            return
        message = CompressedImage(format="jpeg", data=jpeg)
        message.header.stamp = rospy.Time.now()
        self._face.publish(message)

    def state(self) -> dict[str, bool]:
        """Return what can be had here now."""
        return {
            "speak": self._voice.get_num_connections() > 0,
            "listen": self._state.get_num_connections() > 0,
            "face": self._face.get_num_connections() > 0,
            "say": self._speech.get_num_connections() > 0,
        }

    async def say(self, sentence: str, _account: Account) -> None:
        """Let the robot say a sentence. Raises ValueError."""
        if self._speech.get_num_connections() == 0:
            raise ValueError("No program of this robot takes a sentence now.")
        if sentence.strip():
            self._speech.publish(sentence.strip())
