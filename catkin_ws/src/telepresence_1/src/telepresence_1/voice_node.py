"""ROS node voice: the pilot talks through the robot and listens to its microphone, over the link to NAOqi.

Topics and services: see `telepresence_ros.voice_topics`.
Parameters:
    ~pip, ~pport             the robot, see naoqi_driver.naoqi_node
    ~qi_listen_url ("")      where the robot may connect to bring the sound of its microphones: tcp://HOST:PORT, whose
                             host 0.0.0.0 means the address towards it. "": a free port there, unless the robot is on
                             this machine or the link is encrypted. tcp://127.0.0.1:0: no other machine may
    ~microphone, ~speaker ("auto")
    ~echo_cancellation (false)
                             by the sound server: the pilot needs no headset
    ~push_to_talk (false)    start with a muted microphone
    ~conversation (true)     whether there is sound before voice/conversation is called
    ~robot_microphones ("stereo")
                             stereo: 48 kHz, 3 Mbit/s on the robot's Wi-Fi; front: one microphone, 16 kHz, 0.3 Mbit/s
    ~robot_rate (0)          what the robot's loudspeaker plays [Hz]: 16000, 22050, 44100, 48000; 0 leaves it as it is
    ~rtp_host ("127.0.0.1"), ~rtp_port (10001)
                             where the robot's sound is sent by RTP; at 127.0.0.1 this node plays it, and nobody
                             else's packets; elsewhere run `play_rtp`
    ~codec ("")              l16 or opus; "": l16 on this machine, opus elsewhere
    ~jitter (0.01)           seconds that a packet of it may be late
    ~patience (0)            seconds of delay accepted on top, each way, for a busy machine or a poor network
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import rospy
from naoqi_driver.naoqi_node import NaoqiNode
from telepresence_ros.voice_topics import LEVEL_PERIOD, Level, VoiceTopics

from telepresence import ports
from telepresence.audio.echo import EchoCancellation
from telepresence.audio.microphone import Microphone
from telepresence.audio.voice_input import VoiceInput
from telepresence_1.microphone_stream import MicrophoneStream
from telepresence_1.network import NoRoute, is_loopback
from telepresence_1.rtp_sound import CODECS, RtpPlayer, RtpSender
from telepresence_1.speaker_stream import SpeakerStream


class Voice:
    """Connects the pilot's microphone and loudspeaker with those of the robot; reads its parameters once.

    Raises:
        ValueError: A parameter makes no sense; the text says which.
    """

    def __init__(self) -> None:
        self._node = NaoqiNode("voice", listens=True)
        self._echo: EchoCancellation | None = None
        microphone, speaker = (str(rospy.get_param(f"~{name}", "auto")) for name in ("microphone", "speaker"))
        host = str(rospy.get_param("~rtp_host", "127.0.0.1"))
        through: list[Callable[[str], str]] = [str, str]
        if rospy.get_param("~echo_cancellation", False):
            if is_loopback(host):
                self._echo = EchoCancellation(microphone, speaker, "pepper")
                through = [self._echo.microphone, self._echo.loudspeaker]
            else:
                rospy.logwarn("no echo cancellation: the loudspeaker is another machine's, %s", host)
        port = int(rospy.get_param("~rtp_port", ports.RTP_SOUND))
        codec = str(rospy.get_param("~codec", "")) or ("l16" if is_loopback(host) else "opus")
        if codec not in CODECS:
            raise ValueError(f"~codec is {' or '.join(CODECS)}, not '{codec}'")
        patience = float(rospy.get_param("~patience", 0.0))
        if not 0.0 <= patience <= 1.0:
            raise ValueError(f"~patience is between 0 and 1 s, not {patience}")
        self._levels = (Level(), Level())
        connection = self._node.connection
        self._speaker_stream = SpeakerStream(connection, int(rospy.get_param("~robot_rate", 0)), patience)
        self._input = VoiceInput(lambda: self._speaker_stream.rate, self._speaker_stream.put, self._levels[0].put)
        self._microphone = Microphone(
            microphone, lambda: self._speaker_stream.rate, self._input.put, self._levels[0].put, through[0]
        )
        self._speaker_stream.on_rate = self._microphone.pipeline.reopen
        self._microphone_stream = MicrophoneStream(
            connection,
            self._received,
            str(rospy.get_param("~robot_microphones", "stereo")),
        )
        channels = (self._microphone_stream.rate, self._microphone_stream.channels)
        self._sender = RtpSender(*channels, host, port, codec, self._levels[1].put, patience)
        self._player: RtpPlayer | None = None
        self._playable = not is_loopback(host)  # on this machine not until there is a loudspeaker
        self._conversing = self._muted = self._listeners = False
        if is_loopback(host):
            jitter = float(rospy.get_param("~jitter", 0.01))
            origin = self._sender.origin
            self._player = RtpPlayer(
                speaker, host, port, codec, jitter, self._speaker_changed, patience, origin, through[1]
            )
            if self._echo is not None:
                self._echo.join(self._microphone.pipeline.reopen, self._player.pipeline.reopen)
        self._topics = VoiceTopics(
            self, bool(rospy.get_param("~push_to_talk", False)), bool(rospy.get_param("~conversation", True))
        )

    def run(self) -> int:
        for part in (self._speaker_stream, self._microphone, self._microphone_stream, self._sender, self._player):
            if part is not None:
                part.start()
        return self._topics.forget_after(self._node.run(self._loop))

    def _loop(self) -> None:
        try:
            self._topics.run(self._node.cycles(LEVEL_PERIOD))
        finally:
            # The robot's microphones first: unsubscribing needs the link, which ends after this.
            for part in (
                self._microphone_stream,
                self._microphone,
                self._speaker_stream,
                self._sender,
                self._player,
                self._echo,
            ):
                if part is not None:
                    part.close()

    def _speaker_changed(self, problem: str | None) -> None:
        self._playable = problem is None
        self._want()

    def _want(self) -> None:
        """Ask the robot for its sound, or not, as things stand."""
        self._microphone_stream.wanted = self._listeners or (self._playable and self._plays)

    @property
    def _plays(self) -> bool:
        """Whether the pilot's player is to get the robot's sound. A muted one here gets it, for the meter; another
        machine's would play it."""
        return self._conversing and (self._player is not None or not self._muted)

    def _received(self, block: np.ndarray, rate: int, arrival: float) -> None:
        if self._plays:
            self._sender.push(block, arrival)
        self._topics.pass_on(block.astype("<i2").tobytes(), rate, block.shape[1])

    # --- for the topics -----------------------------------------------------------------------------------------------

    def levels(self) -> tuple[float, float]:
        return self._levels[0].now, self._levels[1].now

    def describe(self) -> tuple[str, str]:
        pilot = None if self._input.elsewhere else self._microphone.pipeline.problem
        if not pilot and not self._node.connection.connected:
            pilot = "the robot is not connected"
        if not pilot and self._speaker_stream.problem:
            pilot = f"not played: {self._speaker_stream.problem}"
        robot = self._player.pipeline.problem if self._player else None
        robot = robot or self._sender.pipeline.problem
        if not robot and self._microphone_stream.wanted:
            robot = self._microphone_stream.problem
        if not robot and self._muted:
            robot = "muted"
        return pilot or ("elsewhere" if self._input.elsewhere else "live"), robot or "live"

    def figures(self) -> dict[str, object]:
        played, lost = self._player.packets() if self._player else (0, 0)
        return {
            "pieces sent": self._speaker_stream.pieces,
            "robot's queue emptied": self._speaker_stream.flushes,
            "robot's rate": self._speaker_stream.rate,
            "blocks heard": self._microphone_stream.blocks,
            "packets played": played,
            "packets lost": lost,
        }

    def chosen(self) -> tuple[str, str]:
        return self._microphone.device, self._player.device if self._player else "none"

    def converse(self, wanted: bool) -> None:
        self._conversing = wanted
        self._microphone.pipeline.wanted = wanted
        if self._echo is not None and self._player is not None and wanted is not self._echo.wanted:
            self._echo.wanted = wanted
            self._player.pipeline.reopen()
        self._want()

    def open_microphone(self, opened: bool) -> None:
        self._input.open = opened

    def mute_speaker(self, muted: bool) -> None:
        self._muted = muted
        if self._player is not None:
            self._player.muted = muted
        self._want()

    def speak(self, frames: bytes, rate: int, channels: int) -> None:
        self._input.put_from_elsewhere(frames, rate, channels)

    def listen(self, wanted: bool) -> None:
        self._listeners = wanted
        self._want()

    def choose_microphone(self, device: str) -> None:
        self._microphone.choose(device)

    def choose_speaker(self, device: str) -> None:
        if self._player is not None:
            self._player.choose(device)


def main() -> int:
    """Run the node; the exit code for the process."""
    try:
        return Voice().run()
    except (NoRoute, OSError, ValueError) as error:
        rospy.logfatal("%s", error)
        return 1
