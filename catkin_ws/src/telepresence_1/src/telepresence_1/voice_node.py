"""ROS node voice: the pilot speaks through the robot and hears what it hears, over the link to NAOqi.

Publishes:  voice/levels (std_msgs/Float32MultiArray, 10 Hz): mean level [dBFS] of the pilot's microphone and of the
            robot's microphones, -100 for silence. voice/state (std_msgs/String, latched): how things stand, for
            people. voice/devices (std_msgs/String, latched): what can be chosen, one device per line. /diagnostics.
Subscribes: voice/microphone, voice/speaker (std_msgs/String): use this device, see `telepresence.audio.devices`.
Services:   voice/mute_microphone, voice/mute_speaker (std_srvs/SetBool); voice/talk (SetBool): true while the
            push-to-talk button is held, which opens a muted microphone.
Parameters:
    ~pip, ~pport             the robot, see naoqi_driver.naoqi_node
    ~microphone, ~speaker ("auto")
    ~echo_cancellation (false)
                             by the sound server: the pilot needs no headset
    ~push_to_talk (false)    start with a muted microphone
    ~robot_microphones ("stereo")
                             stereo: 48 kHz, 3 Mbit/s on the robot's Wi-Fi; front: one microphone, 16 kHz, 0.3 Mbit/s
    ~robot_rate (0)          what the robot's loudspeaker plays [Hz]: 16000, 22050, 44100, 48000; 0 leaves it as it is
    ~own_address ("")        this machine as the robot sees it; found out when empty
    ~rtp_host ("127.0.0.1"), ~rtp_port (10001)
                             where the robot's sound is sent by RTP; at 127.0.0.1 this node plays it, elsewhere run
                             `play_rtp`
    ~codec ("")              l16 or opus; "": l16 on this machine, opus elsewhere
    ~jitter (0.015)          seconds that a packet of it may be late
"""

from __future__ import annotations

import time
from collections.abc import Callable

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from naoqi_driver.naoqi_node import NaoqiNode
from std_msgs.msg import Float32MultiArray, String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse

from telepresence.audio import devices
from telepresence.audio.echo import LOUDSPEAKER, MICROPHONE, EchoCancellation
from telepresence.audio.pipeline import SILENCE, SoundError
from telepresence_1.com_cam_node import route_logs
from telepresence_1.network import NoRoute, choose_address, is_loopback
from telepresence_1.pilot_microphone import PilotMicrophone
from telepresence_1.robot_ears import RobotEars
from telepresence_1.robot_mouth import RobotMouth
from telepresence_1.rtp_sound import CODECS, PORT, RtpPlayer, RtpSender

LEVEL_PERIOD, DEVICES_PERIOD = 0.1, 5.0
FADE = 0.5
"""Seconds after which a level that nobody renews is silence."""


class Level:
    """A level meter's newest value."""

    def __init__(self) -> None:
        self._value, self._at = SILENCE, 0.0

    def put(self, value: float) -> None:
        self._value, self._at = value, time.monotonic()

    @property
    def now(self) -> float:
        return self._value if time.monotonic() - self._at < FADE else SILENCE


class Voice:
    """Joins microphone and mouth, ears and loudspeaker; reads its parameters once.

    Raises:
        ValueError: A parameter makes no sense; the text says which.
    """

    def __init__(self) -> None:
        self._node = NaoqiNode("voice")
        route_logs()
        self._muted = bool(rospy.get_param("~push_to_talk", False))
        self._talking = False
        self._echo: EchoCancellation | None = None
        microphone, speaker = (str(rospy.get_param(f"~{name}", "auto")) for name in ("microphone", "speaker"))
        microphone, speaker = self._cancel_echo(microphone, speaker)
        host = str(rospy.get_param("~rtp_host", "127.0.0.1"))
        port = int(rospy.get_param("~rtp_port", PORT))
        codec = str(rospy.get_param("~codec", "")) or ("l16" if is_loopback(host) else "opus")
        if codec not in CODECS:
            raise ValueError(f"~codec is {' or '.join(CODECS)}, not '{codec}'")
        self._levels = (Level(), Level())
        connection = self._node.connection
        self._mouth = RobotMouth(connection, int(rospy.get_param("~robot_rate", 0)))
        self._mouth.open = not self._muted
        self._microphone = PilotMicrophone(microphone, lambda: self._mouth.rate, self._mouth.put, self._levels[0].put)
        self._mouth.on_rate = self._microphone.pipeline.reopen
        self._ears = RobotEars(
            connection,
            lambda block, _rate, arrival: self._sender.push(block, arrival),
            str(rospy.get_param("~robot_microphones", "stereo")),
            self._own_url(),
        )
        self._sender = RtpSender(self._ears.rate, self._ears.channels, host, port, codec, self._levels[1].put)
        self._player: RtpPlayer | None = None
        if is_loopback(host):
            self._ears.wanted = False  # until there is a loudspeaker
            jitter = float(rospy.get_param("~jitter", 0.015))
            self._player = RtpPlayer(speaker, host, port, codec, jitter, self._speaker_changed)
        self._level_topic = rospy.Publisher("voice/levels", Float32MultiArray, queue_size=1)
        self._state_topic = rospy.Publisher("voice/state", String, queue_size=1, latch=True)
        self._devices_topic = rospy.Publisher("voice/devices", String, queue_size=1, latch=True)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)

    def run(self) -> int:
        parts = [self._mouth, self._microphone, self._ears, self._sender, self._player]
        for part in parts:
            if part is not None:
                part.start()
        rospy.Subscriber("voice/microphone", String, lambda message: self._microphone.choose(message.data))
        rospy.Subscriber("voice/speaker", String, lambda message: self._choose_speaker(message.data))
        for name, action in (
            ("mute_microphone", self._mute_microphone),
            ("mute_speaker", self._mute_speaker),
            ("talk", self._talk),
        ):
            rospy.Service(f"voice/{name}", SetBool, self._answer(action))
        return self._node.run(self._loop)

    def _loop(self) -> None:
        try:
            self._tell()
        finally:
            # The ears first: their unsubscribing needs the link, which ends after this.
            for part in (self._ears, self._microphone, self._mouth, self._sender, self._player, self._echo):
                if part is not None:
                    part.close()

    def _cancel_echo(self, microphone: str, speaker: str) -> tuple[str, str]:
        """The devices to use: those behind the sound server's echo cancellation, if it is wanted and there."""
        if not rospy.get_param("~echo_cancellation", False):
            return microphone, speaker
        try:
            self._echo = EchoCancellation(microphone, speaker)
        except SoundError as error:
            rospy.logwarn("%s; use a headset", error)
            return microphone, speaker
        return MICROPHONE, LOUDSPEAKER

    def _own_url(self) -> str | None:
        """Where the robot shall call us; None for loopback."""
        own = str(rospy.get_param("~own_address", ""))
        address = choose_address("", own, str(self._node.connection.address))
        return None if is_loopback(address) else f"tcp://{address}:0"

    def _speaker_changed(self, problem: str | None) -> None:
        self._ears.wanted = problem is None

    def _choose_speaker(self, device: str) -> None:
        if self._player is not None:
            self._player.choose(device)

    def _answer(self, action: Callable[[bool], None]) -> Callable[[SetBoolRequest], SetBoolResponse]:
        def handle(request: SetBoolRequest) -> SetBoolResponse:
            action(request.data)
            self._publish_state()
            return SetBoolResponse(True, self._describe())

        return handle

    def _mute_microphone(self, mute: bool) -> None:
        self._muted = mute
        self._mouth.open = self._talking or not mute

    def _talk(self, talking: bool) -> None:
        self._talking = talking
        self._mouth.open = talking or not self._muted

    def _mute_speaker(self, mute: bool) -> None:
        if self._player is not None:
            self._player.muted = mute

    def _tell(self) -> None:
        told, listed, devices_at = None, None, 0.0
        for now in self._node.cycles(LEVEL_PERIOD):
            self._level_topic.publish(Float32MultiArray(data=[level.now for level in self._levels]))
            state = self._describe()
            if state != told:
                told = state
                self._publish_state()
            if now - devices_at > DEVICES_PERIOD:
                devices_at = now
                self._publish_diagnostics()
                found = devices.names()
                text = "\n".join(f"{kind[:-1]} {name}" for kind, names in found.items() for name in names)
                if text != listed:
                    listed = text
                    self._devices_topic.publish(text)

    def _describe(self) -> str:
        return f"you: {self._describe_pilot()}; robot: {self._describe_robot()}"

    def _describe_pilot(self) -> str:
        problem = self._microphone.pipeline.problem
        if problem:
            return problem
        if not self._node.connection.connected:
            return "the robot is not connected"
        if self._mouth.problem:
            return f"not played: {self._mouth.problem}"
        if not self._mouth.open:
            return "muted"
        return "talking" if self._talking else "live"

    def _describe_robot(self) -> str:
        problem = self._player.pipeline.problem if self._player else None
        problem = problem or self._sender.pipeline.problem or self._ears.problem
        if problem:
            return problem
        return "muted" if self._player and self._player.muted else "live"

    def _publish_state(self) -> None:
        self._state_topic.publish(self._describe())

    def _publish_diagnostics(self) -> None:
        live = self._mouth.problem is None and self._ears.problem is None
        level = DiagnosticStatus.OK if live else DiagnosticStatus.WARN
        played, lost = self._player.packets() if self._player else (0, 0)
        values = {
            "pieces sent": self._mouth.pieces,
            "robot's queue emptied": self._mouth.flushes,
            "robot's rate": self._mouth.rate,
            "blocks heard": self._ears.blocks,
            "packets played": played,
            "packets lost": lost,
        }
        status = DiagnosticStatus(level, f"{rospy.get_name().strip('/')}: sound", self._describe(), "", [])
        status.values = [KeyValue(key, str(value)) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)


def main() -> int:
    """Run the node; the exit code for the process."""
    try:
        return Voice().run()
    except (NoRoute, OSError, ValueError) as error:
        rospy.logfatal("%s", error)
        return 1
