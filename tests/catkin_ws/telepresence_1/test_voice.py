"""Pilot and robot hear each other: the node `voice`, the simulated Pepper, and a sound server without a sound card."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from sound_lab import RATE, Heard, Mouth, Recorder, SoundServer, match, sentence

from pepper_sim.simulation import Simulation

pytestmark = pytest.mark.ros

PILOT_SAYS = "Good morning, this is the pilot. May I come in and have a look at the kitchen?"
ROBOT_HEARS = "Hello robot, yes of course, but please be careful, the cat is asleep on the carpet."


PATIENCE = 0.2
"""Seconds: the machine that runs the tests may be busy with others. How late sound is, the benchmark measures."""
ATTEMPTS = 10
"""How often a sentence is said on a machine that stutters."""


class Rig:
    """Sound server, simulated Pepper, node, and recorders on both loudspeakers."""

    def __init__(self, graph, folder: Path) -> None:
        self.graph = graph
        self.server = SoundServer(folder)
        os.environ.update(self.server.environment())
        graph.environment.update(self.server.environment())
        self.patch = pytest.MonkeyPatch()
        self.patch.setattr("pepper_sim.sound.loudspeaker_output.PATIENCE", PATIENCE)
        self.record = folder / "speaker.wav"
        self.robot: Simulation | None = None
        self.start_robot()
        self.rtp_port = graph.free_port()
        self.node = self.start_node()
        self.said = Recorder(self.server, "pilot_mic.monitor")
        self.at_robot = Recorder(self.server, "robot_speaker.monitor")
        self.at_pilot = Recorder(self.server, "pilot_speaker.monitor")
        self.mouth = Mouth(self.server, "pilot_mic")
        self.probe = graph.probe()
        self.probe.watch("/voice/state", "std_msgs/String", ["data"])
        self.probe.watch("/voice/levels", "std_msgs/Float32MultiArray", ["data"])

    def start_robot(self) -> None:
        """Start the robot on the same port every time."""
        options = {"speaker": "robot_speaker", "record_speaker": str(self.record)}
        self.robot = Simulation("empty", 0, "127.0.0.1", self.graph.robot_port, **options)

    def start_node(self):
        return self.graph.run_node(
            *("telepresence_1", "voice", "_microphone:=pilot_mic.monitor", "_speaker:=pilot_speaker"),
            *(f"_rtp_port:={self.rtp_port}", f"_patience:={PATIENCE}", "_jitter:=0.1"),
        )

    def robots_listeners(self) -> int:
        """How many streams of its microphones the robot sends."""
        device = next(s for s in self.robot.server.catalogue.services if s.name == "ALAudioDevice")
        return sum(stream.alive for stream in device._streams.values())

    def person_says(self, samples: np.ndarray) -> float:
        """Play speech in the room, from the returned time on."""
        start = time.monotonic() + 0.1
        self.robot.room.surroundings.play(samples, RATE, start)
        return start

    def both_hear(self, tone: float) -> bool:
        """Play half a second of a tone each way; whether it came out at the other ends."""
        samples = (0.3 * np.sin(2 * np.pi * tone * np.arange(RATE // 2) / RATE)).astype(np.float32)
        begin = time.monotonic()
        self.mouth.say(samples)
        self.person_says(samples)
        time.sleep(1.2)
        return all(_tone(ear.between(begin, time.monotonic()), tone) > 0.02 for ear in (self.at_robot, self.at_pilot))

    def state(self) -> str:
        return self.probe.newest("/voice/state")[0]

    def close(self) -> None:
        for part in (self.said, self.at_robot, self.at_pilot, self.mouth):
            part.close()
        self.node.end()
        self.robot.close()
        self.server.close()
        self.patch.undo()
        for name in self.server.environment():
            os.environ.pop(name, None)


def _tone(samples: np.ndarray, frequency: float) -> float:
    """Greatest amplitude of a frequency over a tenth of a second."""
    count = RATE // 10
    wave = np.exp(-2j * np.pi * frequency * np.arange(count) / RATE)
    pieces = samples[: len(samples) // count * count].reshape(-1, count)
    return float(np.abs(pieces @ wave).max() * 2 / count)


@pytest.fixture(scope="module")
def rig(graph, tmp_path_factory: pytest.TempPathFactory, wait_until: Callable) -> Iterator[Rig]:
    rig = Rig(graph, tmp_path_factory.mktemp("sound"))
    try:
        wait_until(lambda: rig.state() == "you: live; robot: live", f"sound both ways; {rig.node.output}")
        yield rig
    finally:
        rig.close()


def test_another_program_speaks_to_the_pilot(rig: Rig) -> None:
    """Its RTP packets come to the port on which the robot's sound is played."""
    tone = np.sin(2 * np.pi * 900.0 * np.arange(RATE * 2) / RATE) * 10_000
    stereo = np.repeat(tone.astype(">i2")[:, None], 2, axis=1)
    begin = time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for number in range(120):
            header = struct.pack(">BBHII", 0x80, 96, number, number * 352, 4711)
            stranger.sendto(header + stereo[number * 352 : (number + 1) * 352].tobytes(), ("127.0.0.1", rig.rtp_port))
            if number % 40 == 0:  # in bursts, so that they are more than the robot's packets for a moment
                time.sleep(0.3)
    time.sleep(0.5)  # in which none of it may be played
    assert _tone(rig.at_pilot.between(begin, time.monotonic()), 900.0) < 0.005


@pytest.mark.alone
def test_both_sides_hear_each_other_at_once(rig: Rig, record_property: Callable) -> None:
    ours, theirs = sentence(PILOT_SAYS), sentence(ROBOT_HEARS, "en-gb")
    at_robot, at_pilot = Heard(ours), Heard(theirs)
    for _attempt in range(ATTEMPTS):
        begin = time.monotonic()
        rig.mouth.say(ours)
        heard_from = rig.person_says(theirs)
        time.sleep(max(len(ours), len(theirs)) / RATE + 2.0)
        _, place = match(ours, rig.said.between(begin, time.monotonic()))
        at_robot.listen(begin + place, rig.at_robot)
        at_pilot.listen(heard_from, rig.at_pilot)
        if min(at_robot.worst, at_pilot.worst) >= 0.9:
            break
    for name, heard in (("pilot to robot", at_robot), ("robot to pilot", at_pilot)):
        record_property(name, str(heard))
        print(f"{name}: {heard}")
        assert heard.worst >= 0.9, f"{name}: {heard}"


@pytest.mark.alone
def test_muted_is_silent_and_the_talk_button_opens_it(rig: Rig, wait_until: Callable) -> None:
    probe = rig.probe

    def switch(service: str, on: bool) -> str:
        answered, answer = probe.call(f"/voice/{service}", "std_srvs/SetBool", {"data": on})
        assert answered and answer["success"]
        return answer["message"]

    def heard(within: float = 1.2, metered: bool = True) -> float:
        """How loud a tone is at the robot that the pilot's microphone got."""
        begin = time.monotonic()
        tone = (0.3 * np.sin(2 * np.pi * 500.0 * np.arange(RATE // 2) / RATE)).astype(np.float32)
        rig.mouth.say(tone)
        wait_until(lambda: rig.said.level(0.1) > 0.05, "somebody speaks")
        if metered:
            wait_until(lambda: -25.0 < probe.newest("/voice/levels")[0][0] < -8.0, "the meter shows it")
        time.sleep(within)
        return _tone(rig.at_robot.between(begin, time.monotonic()), 500.0)

    assert switch("mute_microphone", True) == "you: muted; robot: live"
    try:
        assert heard() < 0.005, "a muted microphone is heard"
        assert switch("talk", True).startswith("you: talking")
        wait_until(lambda: heard(3.0) > 0.02, "the talk button opens a muted microphone")
        assert switch("talk", False).startswith("you: muted")
        for _ in range(2):
            switch("talk", True)
        wait_until(lambda: probe.newest("/voice/state")[0].startswith("you: talking"), "somebody holds it")
        wait_until(
            lambda: probe.newest("/voice/state") == ["you: muted; robot: live"], "whoever held the button is gone"
        )
    finally:
        switch("talk", False)
        told = switch("mute_microphone", False)
    assert told == "you: live; robot: live"
    assert switch("mute_speaker", True) == "you: live; robot: muted"
    begin = time.monotonic()
    rig.person_says((0.3 * np.sin(2 * np.pi * 700.0 * np.arange(RATE // 2) / RATE)).astype(np.float32))
    wait_until(lambda: probe.newest("/voice/levels")[0][1] > -25.0, "the robot's meter moves")
    assert _tone(rig.at_pilot.between(begin, time.monotonic()), 700.0) < 0.005, "a muted loudspeaker is heard"
    assert switch("conversation", False) == "no conversation"
    try:
        assert heard(metered=False) < 0.005, "a microphone is heard without a conversation"
    finally:
        switch("conversation", True)
    wait_until(lambda: rig.state() == "you: live; robot: muted", "what was muted before is muted again")
    assert switch("mute_speaker", False) == "you: live; robot: live"


def test_without_a_conversation_no_microphone_is_open(rig: Rig, wait_until: Callable) -> None:
    others = rig.server.listeners("pilot_mic.monitor") - 1  # the test's own
    assert rig.robots_listeners() == 1
    rig.probe.call("/voice/conversation", "std_srvs/SetBool", {"data": False})
    try:
        wait_until(lambda: rig.server.listeners("pilot_mic.monitor") == others, "the pilot's microphone is closed")
        wait_until(lambda: rig.robots_listeners() == 0, "nor does the robot send what is said beside it")
    finally:
        begin = time.monotonic()
        rig.probe.call("/voice/conversation", "std_srvs/SetBool", {"data": True})
    wait_until(lambda: rig.server.listeners("pilot_mic.monitor") == others + 1, "the microphone is open again")
    print(f"open {time.monotonic() - begin:.2f} s after the conversation has begun")
    wait_until(lambda: rig.both_hear(650.0), "sound both ways")


class Player:
    """A player on another machine, whose address no packet leaves this one for."""

    HOST = "0.0.0.0"

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]

    def gets_any(self, within: float) -> bool:
        """Whether a packet comes within [s] from now on."""
        self._socket.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while self._socket.recv(2048):
                pass
        self._socket.settimeout(within)
        with contextlib.suppress(TimeoutError):
            return bool(self._socket.recv(2048))
        return False


def test_what_is_muted_does_not_reach_a_player_on_another_machine(rig: Rig, wait_until: Callable) -> None:
    player = Player()
    node = rig.graph.run_node(
        *("telepresence_1", "voice", "__ns:=/far", "_microphone:=none", "_speaker:=none"),
        *(f"_rtp_host:={player.HOST}", f"_rtp_port:={player.port}"),
    )
    try:
        wait_until(lambda: player.gets_any(0.2), f"the robot's sound; {node.output}")
        for service, silent in (("mute_speaker", True), ("conversation", False)):
            assert rig.probe.call(f"/far/voice/{service}", "std_srvs/SetBool", {"data": silent})[0]
            wait_until(lambda: not player.gets_any(0.5), f"{service}: what was under way has come")
            assert not player.gets_any(2.0), service
            assert rig.robots_listeners() == 1, "the robot sends it to the other node alone"
            assert rig.probe.call(f"/far/voice/{service}", "std_srvs/SetBool", {"data": not silent})[0]
            wait_until(lambda: player.gets_any(0.2), f"{service}: and there it is again")
    finally:
        node.end()


def test_either_end_may_die_and_come_back(rig: Rig, wait_until: Callable) -> None:
    rig.robot.close()
    wait_until(lambda: "not connected" in rig.state(), "the loss is told")
    rig.start_robot()
    wait_until(lambda: rig.state() == "you: live; robot: live", "the robot is back")
    wait_until(lambda: rig.both_hear(450.0), "sound both ways with the new robot")
    rig.node.kill()
    rig.node = rig.start_node()
    wait_until(lambda: rig.both_hear(550.0), "sound both ways with the new node")
    wait_until(lambda: rig.robots_listeners() == 1, "the dead listener is forgotten")
    assert "Traceback" not in rig.node.output


def test_without_a_sound_server_it_says_so_once(graph, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(graph.environment, "PULSE_SERVER", "unix:/nonexistent/socket")
    node = graph.run_node("telepresence_1", "voice", "__name:=deaf", f"_rtp_port:={graph.free_port()}")
    node.wait_for("no microphone: no sound server")
    node.wait_for("no loudspeaker: no sound server")
    time.sleep(2.5)  # one more attempt
    assert node.output.count("no sound server") == 2, node.output
    assert node.process.poll() is None
    node.signal(signal.SIGINT)
    assert node.process.wait(30) == 0
    assert "Traceback" not in node.output and "GStreamer-CRITICAL" not in node.output, node.output
