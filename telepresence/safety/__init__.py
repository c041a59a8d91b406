"""Nobody gets hit, nobody gets stuck, and the pilot knows why: the velocity that may reach the wheels now."""

from .gate import VelocityGate
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
    "Limits",
    "Odometry",
    "Outline",
    "RangeSource",
    "RobotProfile",
    "State",
    "Swing",
    "VelocityGate",
]
