"""Pepper in numbers: joints, base, sensors, sound, tablet. SI units, vendor spelling of names.

Joint limits: pepper.urdf of ros-naoqi/pepper_robot 0.1.10. Motors, base and sensors: NAOqi 2.8 documentation, the page
is named at each group.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from telepresence.sim.base import Braking


@dataclass(frozen=True)
class JointLimits:
    """Range and strength of a joint: `lower`, `upper` [rad] (hands: fraction), `velocity` [rad/s], `effort` [N m]."""

    lower: float
    upper: float
    velocity: float
    effort: float


LIMITS: Mapping[str, JointLimits] = MappingProxyType(
    {
        "HeadYaw": JointLimits(-2.08567, 2.08567, 7.33998, 5.428),
        "HeadPitch": JointLimits(-0.706858, 0.637045, 9.22756, 2.666),
        "LShoulderPitch": JointLimits(-2.08567, 2.08567, 7.33998, 5.428),
        "LShoulderRoll": JointLimits(0.00872665, 1.56207, 9.22756, 2.666),
        "LElbowYaw": JointLimits(-2.08567, 2.08567, 7.33998, 5.428),
        "LElbowRoll": JointLimits(-1.56207, -0.00872665, 9.22756, 2.666),
        "LWristYaw": JointLimits(-1.82387, 1.82387, 17.3835, 0.2014),
        "LHand": JointLimits(0.02, 0.98, 12.56, 0.144),
        "HipRoll": JointLimits(-0.514872, 0.514872, 2.27032, 10.1884),
        "HipPitch": JointLimits(-1.03847, 1.03847, 2.93276, 19.787),
        "KneePitch": JointLimits(-0.514872, 0.514872, 2.93276, 27.702),
        "RShoulderPitch": JointLimits(-2.08567, 2.08567, 7.33998, 5.428),
        "RShoulderRoll": JointLimits(-1.56207, -0.00872665, 9.22756, 2.666),
        "RElbowYaw": JointLimits(-2.08567, 2.08567, 7.33998, 5.428),
        "RElbowRoll": JointLimits(0.00872665, 1.56207, 9.22756, 2.666),
        "RWristYaw": JointLimits(-1.82387, 1.82387, 17.3835, 0.2014),
        "RHand": JointLimits(0.02, 0.98, 12.56, 0.144),
    }
)
"""Joint -> limits, in the order of NAOqi's group "Body"."""

JOINTS: tuple[str, ...] = tuple(LIMITS)
LEG_JOINTS = ("HipRoll", "HipPitch", "KneePitch")
ENCODER_STEP = math.tau / 4096
"""One step of the joints' Hall-effect sensors, 12-bit magnetic rotary encoders [rad] (page mre_pep). Programs read them
as Device/SubDeviceList/<joint>/Position/Sensor/Value; NAOqi gives access to no Hall sensor below that."""

CONTINUOUS_TORQUE: Mapping[str, float] = MappingProxyType(
    {
        "HipRoll": 7.54,
        "HipPitch": 13.9,
        "KneePitch": 13.9,
        "HeadYaw": 4.35,
        "HeadPitch": 2.81,
        **{
            side + joint: torque
            for side in "LR"
            for joint, torque in (
                ("ShoulderPitch", 4.35),
                ("ShoulderRoll", 2.81),
                ("ElbowYaw", 4.35),
                ("ElbowRoll", 2.81),
                ("WristYaw", 0.22),
                ("Hand", 0.15),
            )
        },
    }
)
"""Torque that each joint can hold permanently [N m] (page motors_pep: motor torque times gear ratio)."""

MOTION_CYCLE = 0.02
"""Period of the motion controller [s] (page control)."""

# --- base (page control-walk) ---
MAX_XY, MAX_THETA = 0.35, 1.0
"""Default top speeds [m/s, rad/s]."""
HARD_MAX_XY, HARD_MAX_THETA = 0.55, 2.0
"""Top speeds that a client may ask for [m/s, rad/s]."""
ACC_XY, ACC_THETA = 0.3, 0.75
"""Default accelerations [m/s², rad/s²]."""
BRAKING = Braking(xy=0.55, theta=3.0)
"""Braking uses the highest accelerations that a client may set [m/s², rad/s²], so that a stop is short."""
ABRUPT_BRAKING = Braking(xy=1.5, theta=6.0)
"""An emergency stop; still below the 1.9 m/s² at which Pepper tips forward (derived from its URDF)."""
LEAST_LEG_STIFFNESS = 0.6
"""The base refuses to move while a leg joint is at or below this stiffness (page control-stiffness)."""

SECURITY_DISTANCE_AHEAD, SECURITY_DISTANCE_BESIDE = 0.40, 0.10
"""Default security distances in the direction of motion and beside it [m] (page reflexes-external-collision)."""

WHEEL_RADIUS = 0.07
WHEEL_CENTRES = ((0.09, 0.155), (-0.17, 0.0), (0.09, -0.155))
"""Wheel centres around base_footprint, x forward and y left [m], counter-clockwise; source: the URDF."""
OUTLINE_RADIUS = 0.085
"""The base's outline is the wheels' triangle widened by this [m]: 480 mm wide and 430 mm long."""
WHEELS: Mapping[str, tuple[float, float, float]] = MappingProxyType(
    {
        "FL": (0.8797, -0.4756, -0.179),
        "FR": (-0.8797, -0.4756, -0.179),
        "B": (0.0, 1.0, -0.170),
    }
)
"""Wheel -> (per vx, per vy, lever of wz [m]): rim speed = dot with the body velocity; derived from the URDF's axes."""

# --- eyes (pages video_3D_pep, video_3D_pep_v18a, video_Stereo_pep) ---
HEADS = ("1.8a", "1.8")
"""Versions of the head. 1.8a and all older ones look through the left eye with a depth camera (Xtion); 1.8 has a colour
camera in each eye and computes depth from the two."""
EYES: Mapping[str, tuple[float, float, float]] = MappingProxyType(
    {"CameraStereoLeft": (0.05138, 0.039, 0.1194), "CameraStereoRight": (0.05138, -0.039, 0.1194)}
)
"""Cameras of head 1.8 and their places in the link Head, x forward, y left [m]. The left one is the URDF's
CameraDepth_frame, because the left eye is depth's frame of reference; the right one is its mirror image. So their
baseline is 78 mm; no document gives it."""
STEREO_FOVY, STEREO_DEPTH_FOVY = 60.0, 58.0
"""Vertical fields of view of the colour pair and of the depth computed from it [degrees]."""

# --- range sensors (pages sonar_pep, laser_pep) ---
SONAR_PERIOD, LASER_PERIOD = 0.1, 0.16
SONAR_MAX = 5.0
SONAR_MIN = 0.25
"""Shortest sonar reading [m]: naoqi_driver's range; the documentation says that closer objects read 0.3."""
SONAR_RESOLUTION = 0.03
SONAR_HALF_ANGLE = math.radians(30.0)
LASER_ANGLES: tuple[float, ...] = tuple(math.radians(28.0 - 4.0 * i) for i in range(15))
"""Direction of Seg01 ... Seg15 in the frame under the laser's camera [rad], leftmost first: 60 degrees in 15 parts."""
LASER_MIN, LASER_MAX = 0.1, 3.0
"""Obstacles are detected between these distances [m]; 3 m is the practical range."""
LASER_MISS = 5.6
"""Distance of the point that is reported when nothing is hit [m]: the theoretical range. Coordinates stay finite, and
drivers that ignore points beyond 3 m get no obstacle."""
SHOVEL_ANGLES: tuple[float, ...] = tuple(math.radians(angle) for angle in (20.0, 0.0, -20.0))
"""Directions of the sloping front laser's Seg01 ... Seg03 [rad]."""
INFRARED_PERIOD = 0.1
INFRARED_RANGE = 0.4
"""An infrared spot detects what is closer than this [m]. No document gives a range: this one ends 0.24 m beyond the
edge of the base, between the lasers, that no other sensor covers; a stop from MAX_XY takes 0.11 m."""

# --- power (page battery_pep) ---
BATTERY_ENERGY = 795.0 * 3600.0
"""[J]"""
BATTERY_VOLTAGE = 26.46

# --- sound (page alaudiodevice) and tablet ---
MICROPHONES = 4
"""Order of the channels: rear left, rear right, front left, front right. So naoqi_driver reads them (its channel map
3, 5, 0, 2) when ALRobotModel._getMicrophoneConfig is not 0; left, right, front, rear is NAO's head."""
SOUND_RATE = 48000
"""Sample rate of the four microphones together and of tones [Hz]."""
VOICE_RATE = 16000
"""Sample rate of one microphone alone [Hz]."""
TABLET_WIDTH, TABLET_HEIGHT = 1280, 800
"""The tablet's screen [px]."""
SCREEN_WIDTH, SCREEN_HEIGHT = TABLET_WIDTH // 2, TABLET_HEIGHT // 2
"""The simulated tablet's screen [px]: half the size of the real one, as its texture in `models/pepper.xml`."""
