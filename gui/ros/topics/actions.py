"""What the window asks of robots besides driving, as rows of their tables: speech, postures, sound. No ROS."""

from __future__ import annotations

from typing import Any

from gui.ros.channels import Answer, Offered, Outgoing, fill_data

POSTURE_TIMEOUT = 20.0
"""[s] that waking up and resting may take."""


def _fill_posture(message: Any, name: str) -> None:
    message.goal.pose_name = name


def _read_empty(_response: Any) -> Answer:
    return Answer(True)


def sound_outgoing() -> tuple[Outgoing, ...]:
    """Return rows that choose a microphone and a loudspeaker."""
    return tuple(Outgoing(name, f"voice/{name}", "std_msgs/String", fill_data) for name in ("microphone", "speaker"))


def pepper_outgoing() -> tuple[Outgoing, ...]:
    """Return rows to say a sentence, to take a posture that pose_manager knows, and to choose sound devices."""
    return (
        *sound_outgoing(),
        Outgoing("say", "speech", "std_msgs/String", fill_data),
        Outgoing("posture", "pepper_robot/pose/body_pose/goal", "naoqi_bridge_msgs/BodyPoseActionGoal", _fill_posture),
    )


def pepper_services() -> tuple[Offered, ...]:
    """Return rows to wake up, to rest, to mute, and to show the pilot's page on the tablet."""
    return (
        *sound_services(),
        Offered("show_page", "com_cam/show_on_tablet", "std_srvs/SetBool", fill_data),
        *(
            Offered(name, f"pepper_robot/pose/{name}", "std_srvs/Empty", read=_read_empty, timeout=POSTURE_TIMEOUT)
            for name in ("wakeup", "rest")
        ),
    )


def careful_services() -> tuple[Offered, ...]:
    """Return the row that switches the careful scan on or off."""
    return (Offered("set_careful", "set_careful", "std_srvs/SetBool", fill_data),)


def sound_services() -> tuple[Offered, ...]:
    """Return rows whose argument true mutes, holds the microphone open (talk), or begins a conversation."""
    names = ("mute_microphone", "mute_speaker", "talk", "conversation")
    return tuple(Offered(name, f"voice/{name}", "std_srvs/SetBool", fill_data) for name in names)
