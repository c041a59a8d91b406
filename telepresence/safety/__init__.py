"""The safety gate: limits a velocity command to what the sensors allow now, and says why.

    gate              VelocityGate, the entry point: feed it sensors, call `step` at a fixed rate, send the result
    messages          what goes in and out: Command, Odometry, Decision, State
    robot_profile     what the gate knows about a robot: outline, limits, range sources
    outline           distance and direction from the robot's outline to obstacles

    timeouts          commands and range sources: newest, too old, frozen, refused
    latches           stop and bumper, which last until a person resets them
    gate_state        the state that the pilot sees, without flicker

    scan, sonar       one measurement, of narrow beams or of a wide cone
    pose_history      odometry of the last second, to place a measurement
    obstacle_memory   points seen before, in the odometry frame
    moving_obstacles  what has moved between two scans
    known_obstacles   all of these joined

    obstacles         the known obstacles measured against the outline
    braking           bounds on the velocity, so that the robot stops in time
    tick_state        what one tick knows: obstacles, and a speed limit for each direction
    velocity_shaper   from command to output
    careful_scan      turning the body to and fro so that sparse beams see everything
    plane             arithmetic on arrays of points

NumPy only: no ROS, no clock (the time is an argument), no threads. The same code runs on the robot and in tests.
"""

from .gate import VelocityGate
from .latches import Latched
from .messages import SECTORS, Command, Decision, Odometry, State
from .outline import Outline
from .robot_profile import PEPPER, ROBOTINO, ROBOTINO_LASER, UNKNOWN, Limits, RangeSource, RobotProfile, Swing
from .timeouts import Health

__all__ = [
    "PEPPER",
    "ROBOTINO",
    "ROBOTINO_LASER",
    "SECTORS",
    "UNKNOWN",
    "Command",
    "Decision",
    "Health",
    "Latched",
    "Limits",
    "Odometry",
    "Outline",
    "RangeSource",
    "RobotProfile",
    "State",
    "Swing",
    "VelocityGate",
]
