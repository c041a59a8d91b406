"""What the window asks robots for besides driving, as rows of the link's table: speech, postures, sound. No ROS."""

from __future__ import annotations

from typing import Any

from gui.ros.channels import Answer, Offered, Outgoing, fill_data

POSTURE_TIMEOUT = 20.0
"""Seconds that waking up and resting may take."""


def _fill_posture(message: Any, name: str) -> None:
    message.goal.pose_name = name


def _read_empty(_response: Any) -> Answer:
    return Answer(True)


def sound_outgoing() -> tuple[Outgoing, ...]:
    """Use this device from now on."""
    return tuple(Outgoing(name, f"voice/{name}", "std_msgs/String", fill_data) for name in ("microphone", "speaker"))


def pepper_outgoing() -> tuple[Outgoing, ...]:
    """Say a sentence; take a posture that pose_manager knows."""
    return (
        *sound_outgoing(),
        Outgoing("say", "speech", "std_msgs/String", fill_data),
        Outgoing("posture", "pepper_robot/pose/body_pose/goal", "naoqi_bridge_msgs/BodyPoseActionGoal", _fill_posture),
    )


def pepper_services() -> tuple[Offered, ...]:
    return (
        *sound_services(),
        *(
            Offered(name, f"pepper_robot/pose/{name}", "std_srvs/Empty", read=_read_empty, timeout=POSTURE_TIMEOUT)
            for name in ("wakeup", "rest")
        ),
    )


def sound_services() -> tuple[Offered, ...]:
    """True mutes, or opens the microphone while it is held."""
    names = ("mute_microphone", "mute_speaker", "talk")
    return tuple(Offered(name, f"voice/{name}", "std_srvs/SetBool", fill_data) for name in names)
