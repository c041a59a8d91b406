"""Topics and services of a voice connection, the same for every robot; relative to the node's namespace.

Publishes:  voice/levels (std_msgs/Float32MultiArray, 10 Hz): mean level [dBFS] of the pilot's microphone and of the
            robot's, -100 for silence. voice/state (std_msgs/String, latched): how things stand, for people.
            voice/devices (std_msgs/String, latched): what can be chosen, one device per line. voice/settings
            (telepresence_msgs/VoiceSettings, latched): the same for programs, and what is muted and chosen.
            voice/from_robot (telepresence_msgs/Sound): what the robot's microphone records, while anybody subscribes.
            /diagnostics.
Subscribes: voice/from_pilot (telepresence_msgs/Sound): a pilot elsewhere speaks; the microphone here is silent then.
            voice/microphone, voice/speaker (std_msgs/String): use this device, see `telepresence.audio.devices`.
Services:   voice/mute_microphone, voice/mute_speaker (std_srvs/SetBool); voice/talk (SetBool): true while the
            push-to-talk button is held, which opens a muted microphone; it is closed when whoever held it is gone:
            after `TALK_LIFE` if true was repeated within that, else after two minutes. voice/conversation
            (SetBool): false is silent both ways, whatever else is set; the microphone here is closed then.
A node that dies and is started again is as silent as it was, with the devices that were chosen, see `KeptState`.
What is muted is muted here: voice/from_pilot and voice/from_robot are switched on and off at their other ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Protocol

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Float32MultiArray, String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse
from telepresence_msgs.msg import Sound, VoiceSettings

from telepresence.audio import devices
from telepresence.audio.pipeline import SILENCE
from telepresence.audio.voice_state import NO_CONVERSATION
from telepresence.security.outside_text import clean
from telepresence_ros.kept_state import KeptState

LEVEL_PERIOD, SLOW_PERIOD = 0.1, 5.0
TALK_LIMIT, TALK_LIFE = 120.0, 3.0
"""Seconds after which a held talk button counts as let go of: one that was pressed once, and one whose holder repeats
that it is held."""
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


class Talk(Protocol):
    """What a robot's voice connection offers to people."""

    def levels(self) -> tuple[float, float]:
        """Return the levels of the pilot and of the robot [dBFS]."""

    def describe(self) -> tuple[str, str]:
        """How the pilot's and the robot's sound stand: "live", "muted", "talking", "elsewhere", or why
        there is none."""

    def figures(self) -> dict[str, object]:
        """Return figures for the diagnostics."""

    def chosen(self) -> tuple[str, str]:
        """The pilot's microphone and loudspeaker, see `telepresence.audio.devices`."""

    def converse(self, wanted: bool) -> None:
        """Open the microphone here, and have the robot's sound for this machine's pilot; or neither."""

    def open_microphone(self, opened: bool) -> None:
        """Let the microphone be heard; one that is muted stays open, and its meter moves."""

    def mute_speaker(self, muted: bool) -> None: ...
    def choose_microphone(self, device: str) -> None: ...
    def choose_speaker(self, device: str) -> None: ...

    def speak(self, frames: bytes, rate: int, channels: int) -> None:
        """Let the robot play what a pilot elsewhere says, see `Sound`. Raises ValueError."""

    def listen(self, wanted: bool) -> None:
        """Hand what the robot records to `VoiceTopics.pass_on`, too; asked again and again."""


class VoiceTopics:
    """Shows a voice connection to the ROS graph.

    Args:
        muted: Whether the microphone starts muted.
        conversation: Whether there is sound before voice/conversation is called.
    """

    def __init__(self, talk: Talk, muted: bool = False, conversation: bool = True) -> None:
        self._voice = talk
        self._kept = kept = KeptState()
        self._conversation = kept.switch("conversation", conversation, quiet=False)
        self._muted, self._talking, self._talk_since = kept.switch("microphone_muted", muted, quiet=True), False, 0.0
        self._talk_life = TALK_LIMIT
        self._speaker_muted = kept.switch("speaker_muted", False, quiet=True)
        self._choices: dict[str, str] = {}
        self._offered: dict[str, list[str]] = {"microphones": [], "loudspeakers": []}
        self._apply()
        self._level_topic = rospy.Publisher("voice/levels", Float32MultiArray, queue_size=1)
        self._state_topic = rospy.Publisher("voice/state", String, queue_size=1, latch=True)
        self._devices_topic = rospy.Publisher("voice/devices", String, queue_size=1, latch=True)
        self._settings_topic = rospy.Publisher("voice/settings", VoiceSettings, queue_size=1, latch=True)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._from_robot = rospy.Publisher("voice/from_robot", Sound, queue_size=10, tcp_nodelay=True)
        rospy.Subscriber("voice/from_pilot", Sound, self._on_pilot, queue_size=50, tcp_nodelay=True)
        rospy.Subscriber("voice/microphone", String, lambda message: self._choose("microphone", message.data))
        rospy.Subscriber("voice/speaker", String, lambda message: self._choose("speaker", message.data))
        for name, action in (
            ("mute_microphone", self._mute),
            ("mute_speaker", self._mute_speaker),
            ("talk", self._talk),
            ("conversation", self._converse),
        ):
            rospy.Service(f"voice/{name}", SetBool, self._answer(action))

    def run(self, cycles: Iterable[float]) -> None:
        """Publish in every cycle (`LEVEL_PERIOD`) until there are no more."""
        told, listed, settings, slow = None, None, None, 0.0
        for part in ("microphone", "speaker"):
            if device := self._kept.text(part):
                self._choose(part, device)
        for now in cycles:
            if self._talking and now - self._talk_since > self._talk_life:
                rospy.logwarn(
                    "whoever held the talk button has said nothing for %.0f s: it is released", self._talk_life
                )
                self._talk(False)
            self._voice.listen(self._from_robot.get_num_connections() > 0)
            self._level_topic.publish(Float32MultiArray(data=list(self._voice.levels())))
            state = self._text()
            if state != told:
                told = state
                self._state_topic.publish(state)
            if now - slow > SLOW_PERIOD:
                slow = now
                self._keep()
                self._publish_diagnostics()
                self._offered = devices.names()
                text = "\n".join(f"{kind[:-1]} {name}" for kind, names in self._offered.items() for name in names)
                if text != listed:
                    listed = text
                    self._devices_topic.publish(text)
            if (newest := self._settings()) != settings:
                settings = newest
                self._settings_topic.publish(settings)

    def forget_after(self, code: int) -> int:
        """See `KeptState.forget_after`."""
        return self._kept.forget_after(code)

    def pass_on(self, frames: bytes, rate: int, channels: int) -> None:
        """Publish what the robot's microphone records, see `Sound`; from any thread."""
        if self._from_robot.get_num_connections() > 0:
            self._from_robot.publish(Sound(rate, channels, frames))

    def _on_pilot(self, message: Sound) -> None:
        try:
            self._voice.speak(message.data, message.rate, message.channels)
        except ValueError as error:
            rospy.logwarn_throttle(10.0, "%s: %s", "voice/from_pilot", error)

    def _text(self) -> str:
        if not self._conversation:
            return NO_CONVERSATION
        pilot, robot = self._voice.describe()
        if pilot == "live" and (self._talking or self._muted):
            pilot = "talking" if self._talking else "muted"
        return f"you: {pilot}; robot: {robot}"

    def _settings(self) -> VoiceSettings:
        offered = (sorted(names) for names in self._offered.values())
        return VoiceSettings(self._muted, self._speaker_muted, *self._voice.chosen(), *offered)

    def _answer(self, action: Callable[[bool], None]) -> Callable[[SetBoolRequest], SetBoolResponse]:
        def handle(request: SetBoolRequest) -> SetBoolResponse:
            action(request.data)
            text = self._text()
            self._state_topic.publish(text)
            return SetBoolResponse(True, text)

        return handle

    def _mute(self, muted: bool) -> None:
        self._muted = muted
        self._apply()
        self._keep()

    def _mute_speaker(self, muted: bool) -> None:
        self._speaker_muted = muted
        self._apply()
        self._keep()

    def _talk(self, talking: bool) -> None:
        now = time.monotonic()
        repeated = self._talking and now - self._talk_since < TALK_LIFE
        self._talking, self._talk_since, self._talk_life = talking, now, TALK_LIFE if repeated else TALK_LIMIT
        self._apply()

    def _converse(self, wanted: bool) -> None:
        self._conversation = wanted
        self._apply()
        self._keep()

    def _choose(self, part: str, device: str) -> None:
        choose = self._voice.choose_microphone if part == "microphone" else self._voice.choose_speaker
        choose(device)
        self._choices[part] = clean(device)
        self._keep()

    def _keep(self) -> None:
        self._kept.keep(
            lambda: {
                **self._choices,
                "conversation": self._conversation,
                "microphone_muted": self._muted,
                "speaker_muted": self._speaker_muted,
            }
        )

    def _apply(self) -> None:
        self._voice.converse(self._conversation)
        self._voice.open_microphone(self._conversation and (self._talking or not self._muted))
        self._voice.mute_speaker(self._speaker_muted or not self._conversation)

    def _publish_diagnostics(self) -> None:
        silent = [text for text in self._voice.describe() if text not in ("live", "muted", "elsewhere")]
        level = DiagnosticStatus.WARN if silent else DiagnosticStatus.OK
        status = DiagnosticStatus(level, f"{rospy.get_name().strip('/')}: sound", self._text(), "", [])
        status.values = [KeyValue(key, str(value)) for key, value in self._voice.figures().items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)
