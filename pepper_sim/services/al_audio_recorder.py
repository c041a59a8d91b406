"""ALAudioRecorder: records the microphones into a file on the robot's disk."""

from __future__ import annotations

from typing import Any

from pepper_sim.body.description import MICROPHONES, SOUND_RATE, VOICE_RATE
from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.audio.recorder import MicrophoneRecorder
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.sound.room import Room

TYPES = ("wav", "ogg")
RATES = (VOICE_RATE, SOUND_RATE)


class ALAudioRecorder(Module):
    """Records WAV and Ogg files."""

    name = "ALAudioRecorder"

    def __init__(self, room: Room, disk: RobotDisk) -> None:
        self._recorder = MicrophoneRecorder(room, disk)

    def close(self) -> None:
        self._recorder.close()

    @remote("v(ssim)")
    def startMicrophonesRecording(self, filename: str, type: str, samplerate: int, channels: Any) -> None:
        """Records into a "wav" or "ogg" file; channels are flags of left, right, front and rear."""
        one_of(type, TYPES, "type")
        one_of(samplerate, RATES, "samplerate")
        if (
            not isinstance(channels, list | tuple)
            or len(channels) != MICROPHONES
            or not all(isinstance(flag, bool | int) for flag in channels)
            or not any(channels)
        ):
            raise ServiceError(f"channels must be four flags, one of them set; got {shown(channels)}")
        self._recorder.start(filename, samplerate, [bool(flag) for flag in channels], type == "ogg")

    @remote("v()")
    def stopMicrophonesRecording(self) -> None:
        """Ends the recording; without one nothing happens."""
        self._recorder.stop()
