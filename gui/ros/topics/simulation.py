"""The simulation guide's topics as rows of a robot's table: body_state, movement_command, restart_simulation. No ROS.

They are the simulator's, not the driver's: in the graph's own namespace where one robot is simulated, in the robot's
where there are several (`gui.robots.Robot.among_others`).
"""

from __future__ import annotations

from typing import Any

from gui.ros.channels import Incoming, Offered, Outgoing, fill_data
from gui.ros.readings import TruePose
from telepresence.teleop.movement import REPORT_HEADER
from telepresence.teleop.robot_readings import LARGEST

ROBOT_CAMERA = "/robot_camera"


def read_body_state(message: Any, arrived: float) -> TruePose:
    """Convert the std_msgs/Float32MultiArray x y z [m] roll pitch yaw [rad].

    Raises:
        ValueError: It does not hold six finite numbers, or one that no robot has.
    """
    numbers = [float(value) for value in message.data[:7]]
    if len(numbers) != 6 or not all(abs(number) <= LARGEST for number in numbers):
        raise ValueError("body_state holds x, y, z, roll, pitch and yaw, six finite numbers")
    x, y, z, roll, pitch, yaw = numbers
    return TruePose(x, y, z, roll, pitch, yaw, arrived)


BODY_STATE = Incoming("true_pose", "/body_state", "std_msgs/Float32MultiArray", read_body_state)
MOVEMENT = Outgoing("movement", "/movement_command", "std_msgs/Int32", fill_data)
"""Commands: 0 stop, 1 forward, 2 backward, until the next one."""
MOVEMENT_REPORT = Outgoing("movement", "/movement_command", "std_msgs/Int32", fill_data, headers=REPORT_HEADER)
"""What a window that drives by velocities does, as the same numbers; nothing moves (`telepresence.teleop.movement`)."""
RESTART = Offered("restart_simulation", "/restart_simulation", timeout=10.0)
