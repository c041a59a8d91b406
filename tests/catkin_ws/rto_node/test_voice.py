"""Pilot and Robotino hear each other by WebRTC: the node `rto_voice`, the robot's sound server, no sound card."""

from __future__ import annotations

import json
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sound_lab import RATE, Heard, Mouth, Recorder, SoundServer, match, sentence

pytestmark = pytest.mark.ros

PILOT_SAYS = "Good morning, this is the pilot. May I come in?"
ROBOT_HEARS = "Hello robot, please be careful, the cat is asleep."
PATIENCE = 0.2
"""Seconds: the machine that runs the tests may be busy with others."""
ATTEMPTS = 10
"""How often a sentence is said on a machine that stutters."""
LIVE = "you: live; robot: live"


ELSEWHERE = """
import sys, numpy as np, rospy
from telepresence_msgs.msg import Sound
rospy.init_node("elsewhere")
heard = []
rospy.Subscriber("voice/from_robot", Sound, heard.append, queue_size=100)
voice = rospy.Publisher("voice/from_pilot", Sound, queue_size=100)
while not (voice.get_num_connections() and heard):
    rospy.sleep(0.05)
rate, count, loudest = rospy.Rate(50), 0, 0
while not rospy.is_shutdown() and loudest < 3000:
    at = (count * 960 + np.arange(960)) / 48000
    voice.publish(Sound(48000, 1, (9000 * np.sin(2 * np.pi * 500 * at)).astype("<i2").tobytes()))
    count += 1
    loudest = max(int(abs(np.frombuffer(piece.data, "<i2").astype(int)).max()) for piece in heard[-20:])
    rate.sleep()
print("heard", heard[-1].rate, heard[-1].channels, flush=True)
"""
"""Speaks by the topics until it hears the robot."""


class Rig:
    def __init__(self, graph, folder: Path) -> None:
        self.graph = graph
        self.server = SoundServer(folder)
        graph.environment.update(self.server.environment())
        self.port = graph.free_port()
        self.robot = self.start_robot()
        node = str(graph.workspace / "lib" / "rto_node" / "rto_voice")
        devices = ("_microphone:=pilot_mic.monitor", "_speaker:=pilot_speaker", f"_patience:={PATIENCE}")
        self.node = graph.run(node, f"_server:=127.0.0.1:{self.port}", *devices)
        self.probe = graph.probe()
        self.probe.watch("/voice/state", "std_msgs/String", ["data"])
        self.ears = {
            name: Recorder(self.server, f"{name}.monitor")
            for name in ("pilot_mic", "pilot_speaker", "robot_mic", "robot_speaker")
        }
        self.mouths = {name: Mouth(self.server, name) for name in ("pilot_mic", "robot_mic")}

    def start_robot(self):
        program = self.graph.run(
            *(sys.executable, "-m", "rto_bringup.onboard", "sound", "--port", str(self.port)),
            *("--microphone", "robot_mic.monitor", "--speaker", "robot_speaker"),
            *("--patience", str(PATIENCE)),
        )
        program.wait_for("sound server listens on")
        return program

    def state(self) -> str:
        return self.probe.newest("/voice/state")[0]

    def converse(self) -> dict[str, Heard]:
        """Both speak at once, again where the machine stutters."""
        sounds = {"pilot": sentence(PILOT_SAYS), "robot": sentence(ROBOT_HEARS, "en-gb")}
        found = {name: Heard(sound) for name, sound in sounds.items()}
        for _attempt in range(ATTEMPTS):
            begin = time.monotonic()
            for name, sound in sounds.items():
                self.mouths[f"{name}_mic"].say(sound)
            time.sleep(max(map(len, sounds.values())) / RATE + 2.0)
            for (name, sound), other in zip(sounds.items(), ("robot_speaker", "pilot_speaker"), strict=True):
                _, place = match(sound, self.ears[f"{name}_mic"].between(begin, time.monotonic()))
                found[name].listen(begin + place, self.ears[other])
            if min(heard.worst for heard in found.values()) >= 0.9:
                break
        return found

    def hears_noise(self) -> bool:
        """Both speak a short word; whether it came out at the other ends."""
        for mouth in self.mouths.values():
            mouth.say(sentence("Yes."))
        time.sleep(1.0)
        return all(self.ears[f"{name}_speaker"].level(1.0) > 0.005 for name in ("pilot", "robot"))

    def close(self) -> None:
        for part in (*self.ears.values(), *self.mouths.values()):
            part.close()
        self.node.end()
        self.robot.end()
        self.server.close()


@pytest.fixture(scope="module")
def rig(graph, tmp_path_factory: pytest.TempPathFactory, wait_until: Callable) -> Iterator[Rig]:
    rig = Rig(graph, tmp_path_factory.mktemp("sound"))
    try:
        wait_until(lambda: rig.state() == LIVE, f"sound both ways; {rig.node.output}")
        yield rig
    finally:
        rig.close()


def test_a_second_pilot_and_nonsense_are_refused(rig: Rig) -> None:
    url = f"http://127.0.0.1:{rig.port}/sound"
    status = json.loads(urllib.request.urlopen(url, timeout=5).read())
    assert status == {"pilots": 1, "microphone": "", "loudspeaker": ""}
    for body, kind, code in ((b"v=0", "application/sdp", 503), (b"hello", "text/plain", 415)):
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(urllib.request.Request(url, body, {"Content-Type": kind}), timeout=5)
        assert refused.value.code == code
    assert rig.state() == LIVE


@pytest.mark.alone
def test_both_sides_hear_each_other_at_once(rig: Rig) -> None:
    for name, heard in rig.converse().items():
        print(f"{name}: {heard}")
        assert heard.worst >= 0.9, f"{name}: {heard}"


def test_without_a_conversation_the_microphone_is_closed(rig: Rig, wait_until: Callable) -> None:
    others = rig.server.listeners("pilot_mic.monitor") - 1  # the test's own
    rig.probe.call("/voice/conversation", "std_srvs/SetBool", {"data": False})
    try:
        wait_until(lambda: rig.server.listeners("pilot_mic.monitor") == others, "it is closed")
    finally:
        rig.probe.call("/voice/conversation", "std_srvs/SetBool", {"data": True})
    wait_until(lambda: rig.hears_noise(), "sound both ways")


def test_a_robot_that_died_is_found_again(rig: Rig, wait_until: Callable) -> None:
    rig.robot.kill()
    wait_until(lambda: rig.state() != LIVE, "the loss is told")
    rig.robot = rig.start_robot()
    wait_until(lambda: rig.state() == LIVE, "connected again")
    wait_until(lambda: rig.hears_noise(), "sound again")


def test_a_pilot_elsewhere_speaks_and_listens_by_topics(rig: Rig, wait_until: Callable) -> None:
    elsewhere = rig.graph.run(sys.executable, "-c", ELSEWHERE)
    wait_until(lambda: rig.ears["robot_speaker"].level(1.0) > 0.05, "the robot plays what is said elsewhere")
    assert rig.state() == "you: elsewhere; robot: live"
    wait_until(lambda: rig.mouths["robot_mic"].say(sentence("Yes.")) or elsewhere.process.poll() == 0, "it is answered")
    assert "heard 48000 2" in elsewhere.output
    wait_until(lambda: rig.state() == LIVE, "the microphone here is the pilot's again")


def test_echo_cancellation_holds_the_microphone_only_while_there_is_a_conversation(
    graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wait_until: Callable
) -> None:
    server = SoundServer(tmp_path)  # of its own: PulseAudio moves the streams of others to the new microphone
    try:
        for name, value in server.environment().items():
            monkeypatch.setitem(graph.environment, name, value)
        node = graph.run(
            *(str(graph.workspace / "lib" / "rto_node" / "rto_voice"), "__ns:=/echo", "_echo_cancellation:=true"),
            *(f"_server:=127.0.0.1:{graph.free_port()}", "_microphone:=pilot_mic.monitor", "_speaker:=pilot_speaker"),
        )
        probe = graph.probe()
        wait_until(lambda: server.listeners("pilot_mic.monitor") == 1, f"it is held; {node.output}")
        for wanted in (False, True):
            assert probe.call("/echo/voice/conversation", "std_srvs/SetBool", {"data": wanted})[0]
            wait_until(lambda wanted=wanted: server.listeners("pilot_mic.monitor") == wanted, f"{wanted} {node.output}")
        assert node.end() == 0
        assert server.listeners("pilot_mic.monitor") == 0, "it is unloaded at the end"
    finally:
        server.close()
