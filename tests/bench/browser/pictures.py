"""Publishes pictures with the time drawn into them: `python pictures.py TOPIC RATE`.

Moving texture with camera noise."""

from __future__ import annotations

import sys

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import Image

from telepresence.video.frame_timestamp import draw_time
from telepresence.video.images import fill_image_message

WIDTH, HEIGHT, FRAMES = 640, 480, 60
NOISE = 3.0
"""Standard deviation of the camera's noise, of 255."""


def frames() -> list[np.ndarray]:
    """A round of different pictures, made before the first is sent: making them must not count as the page's work."""
    rng = np.random.default_rng(1)
    texture = cv2.resize(rng.integers(60, 190, (24, 32, 3), np.uint8), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    return [
        np.clip(np.roll(texture, 4 * number, axis=1) + rng.normal(0.0, NOISE, texture.shape), 0, 255).astype(np.uint8)
        for number in range(FRAMES)
    ]


def main(topic: str, rate: float) -> None:
    rospy.init_node("pictures")
    publisher = rospy.Publisher(topic, Image, queue_size=1)
    pictures, number, ticks = frames(), 0, rospy.Rate(rate)
    message = Image()
    while not rospy.is_shutdown():
        picture = pictures[number % FRAMES]
        number += 1
        message.header.stamp = rospy.Time.now()
        draw_time(picture, message.header.stamp.to_sec())
        publisher.publish(fill_image_message(message, picture, "rgb8"))
        try:
            ticks.sleep()
        except rospy.ROSInterruptException:
            break


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
