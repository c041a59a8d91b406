"""The node rto_voice: the pilot talks through a Robotino and listens to its microphone, by WebRTC.

The robot's end is the sound server that runs on it (`python -m rto_bringup.onboard sound`).
Topics and services: see `telepresence_ros.voice_topics`.
Parameters: ~server (127.0.0.1): host or host:port; the port is 8084 unless given; ~microphone, ~speaker ("auto"): see
            `telepresence.audio.devices`; ~push_to_talk (false): start with a muted microphone; ~echo_cancellation
            (false): by the sound server; ~conversation (true): sound before voice/conversation is called; ~patience
            (0): seconds of delay accepted on top, for a busy machine or a poor network.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

import rospy
from telepresence_ros.node import ROBOT_PATIENCE, Node
from telepresence_ros.voice_topics import LEVEL_PERIOD, Level, VoiceTopics

from rto_node.robot_sound import RobotSound
from telepresence.audio.echo import EchoCancellation
from telepresence.audio.loudspeaker import Loudspeaker
from telepresence.audio.microphone import Microphone
from telepresence.audio.voice_input import VoiceInput
from telepresence.audio.webrtc_sound import RATE


class Voice:
    """Joins microphone and loudspeaker with the robot's sound server."""

    def __init__(self) -> None:
        self._node = Node("rto_voice")
        logging.getLogger("aioice").setLevel(logging.WARNING)
        self._levels = (Level(), Level())
        try:
            self._robot = RobotSound(str(rospy.get_param("~server", "127.0.0.1")), self._received)
        except ValueError as error:
            raise SystemExit(f"{rospy.get_name()}: {error}") from None
        microphone, speaker = (str(rospy.get_param(f"~{name}", "auto")) for name in ("microphone", "speaker"))
        self._echo: EchoCancellation | None = None
        through: list[Callable[[str], str]] = [str, str]
        if rospy.get_param("~echo_cancellation", False):
            self._echo = EchoCancellation(microphone, speaker, "robotino")
            through = [self._echo.microphone, self._echo.loudspeaker]
        self._input = VoiceInput(lambda: RATE, self._robot.put, self._levels[0].put)
        self._microphone = Microphone(microphone, lambda: RATE, self._input.put, self._levels[0].put, through[0])
        patience = float(rospy.get_param("~patience", 0.0))
        self._loudspeaker = Loudspeaker(speaker, RATE, patience=patience, on_level=self._levels[1].put, via=through[1])
        if self._echo is not None:
            self._echo.join(self._microphone.pipeline.reopen, self._loudspeaker.pipeline.reopen)
        self._topics = VoiceTopics(
            self, bool(rospy.get_param("~push_to_talk", False)), bool(rospy.get_param("~conversation", True))
        )

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        return self._topics.forget_after(self._node.run(self._loop))

    def _loop(self) -> None:
        parts = (self._robot, self._loudspeaker, self._microphone)
        try:
            for part in parts:
                part.start()
            self._topics.run(self._node.cycles(LEVEL_PERIOD, ROBOT_PATIENCE))
        finally:
            for part in parts:
                part.close()
            if self._echo is not None:
                self._echo.close()

    def _received(self, frames: bytes) -> None:
        self._loudspeaker.push(frames)
        self._topics.pass_on(frames, RATE, 2)

    # --- for the topics -----------------------------------------------------------------------------------------------

    def levels(self) -> tuple[float, float]:
        return self._levels[0].now, self._levels[1].now

    def describe(self) -> tuple[str, str]:
        problem = self._robot.problem
        robot = self._loudspeaker.pipeline.problem or problem or ("muted" if self._loudspeaker.muted else "live")
        if self._input.elsewhere:
            return problem or "elsewhere", robot
        return self._microphone.pipeline.problem or problem or "live", robot

    def figures(self) -> dict[str, object]:
        return {"connections": self._robot.connections, "frames heard": self._robot.frames}

    def chosen(self) -> tuple[str, str]:
        return self._microphone.device, self._loudspeaker.device

    def converse(self, wanted: bool) -> None:
        self._microphone.pipeline.wanted = wanted
        if self._echo is not None and wanted is not self._echo.wanted:
            self._echo.wanted = wanted
            self._loudspeaker.pipeline.reopen()

    def open_microphone(self, opened: bool) -> None:
        self._input.open = opened

    def mute_speaker(self, muted: bool) -> None:
        self._loudspeaker.muted = muted

    def speak(self, frames: bytes, rate: int, channels: int) -> None:
        self._input.put_from_elsewhere(frames, rate, channels)

    def listen(self, wanted: bool) -> None:
        """The robot's microphone is sent anyway."""

    def choose_microphone(self, device: str) -> None:
        self._microphone.choose(device)

    def choose_speaker(self, device: str) -> None:
        self._loudspeaker.choose(device)


def main() -> int:
    """Run the node; the exit code."""
    return Voice().run()
