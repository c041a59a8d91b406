"""Reads a recorded session from a bag. Needs the library rosbag, but neither a master nor a node."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rosbag

from gui.recording.session import Session
from telepresence.geometry import yaw_of
from telepresence.security.outside_text import clean, clean_name

_TWIST = "geometry_msgs/Twist"


def read_session(path: Path) -> Session:
    """Return the session in a bag. What the bag lacks stays empty.

    Raises:
        ValueError: The file is no bag, or an empty one.
    """
    try:
        bag = rosbag.Bag(str(path))
    except (rosbag.ROSBagException, OSError) as error:
        raise ValueError(f"{path} cannot be read as a bag: {error}") from error
    with bag:
        if bag.get_message_count() == 0:
            raise ValueError(f"{path} holds no messages; did the robot's programs run?")
        return _collect(bag)


def _collect(bag: rosbag.Bag) -> Session:
    kinds = {name: info.msg_type for name, info in bag.get_type_and_topic_info().topics.items()}
    twists = sorted(name for name, kind in kinds.items() if kind == _TWIST)
    # Robotino's safety gate reads safe_cmd_vel and writes cmd_vel: the pilot's commands are on the first.
    wanted = next((name for name in twists if name.endswith("safe_cmd_vel")), twists[0] if twists else None)
    start = bag.get_start_time()
    path, commands, safety, pictures, battery = [], [], [], [], []
    states: list[str] = []
    reasons: list[str] = []
    for topic, message, stamp in bag.read_messages():
        t, kind = stamp.to_sec() - start, kinds[topic]
        if kind == "nav_msgs/Odometry":
            p, q = message.pose.pose.position, message.pose.pose.orientation
            path.append((t, p.x, p.y, yaw_of(q.w, q.x, q.y, q.z)))
        elif topic == wanted:
            commands.append((t, message.linear.x, message.linear.y, message.angular.z))
        elif kind == "telepresence_msgs/SafetyState":
            safety.append((t, message.vx, message.vy, message.wz, message.gap))
            states.append(clean_name(message.state))
            reasons.append(clean(message.reason))
        elif kind == "sensor_msgs/CompressedImage":
            pictures.append((t, stamp.to_sec() - message.header.stamp.to_sec()))
        elif kind == "sensor_msgs/BatteryState":
            battery.append((t, message.percentage, message.voltage))
    return Session(
        start, bag.get_end_time() - start, _table(path, 4), _table(commands, 4), _table(safety, 5), tuple(states),
        tuple(reasons), _table(pictures, 2), _table(battery, 3), bag.get_message_count(),
    )  # fmt: skip


def _table(rows: list, width: int) -> np.ndarray:
    return np.array(rows, float).reshape(-1, width)
