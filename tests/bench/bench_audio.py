"""Mouth to ear, each way at once, against the latency that the pipelines are set to; and sound through a bad network.

The simulated Pepper, the node `voice` as a person starts it, and PulseAudio with null sinks, which has no sound card's
own latency. A sentence is looked for, half a second at a time, in what came out at the other side.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from report import Row, percentile
from ros_graph import free_port, private_master, wait_for

sys.path.append(str(Path(__file__).resolve().parents[1] / "lab"))

from rtp_line import LONGEST, Line, Talk
from sound_lab import RATE, Mouth, Recorder, SoundServer, match, sentence
from telepresence_1 import rtp_sound, speaker_stream

from pepper_sim.naoqi.audio.microphones import BLOCK
from pepper_sim.simulation import Simulation
from pepper_sim.sound import loudspeaker_output
from telepresence.audio import devices
from telepresence.station import processes

SECONDS = float(os.environ.get("BENCH_AUDIO_SECONDS", "600"))
CUT = 10.0
PILOT = "Good morning, this is the pilot. I would like to see the kitchen, and then the garden. May I come in?"
ROOM = "Hello robot, yes of course, but drive slowly please: the cat is asleep on the carpet, and grandmother too."
PIECE, LATEST = 0.5, 0.6
"""Seconds of sound that are searched for at once, and how late they may be found."""
WHOLE = 0.95
"""How alike a piece is at least when nothing of it is missing."""
JITTER = 0.01
SINK, SOURCE = devices.SINK_BUFFER, 0.010
"""Buffers of telepresence.audio.devices [s]."""
TO_ROBOT = (
    SOURCE
    + speaker_stream.PIECE * (1 + speaker_stream.CUSHION)
    + loudspeaker_output.PERIOD
    + loudspeaker_output.LEAD
    + SINK
)
TO_PILOT = BLOCK[48000] / 48000 + rtp_sound.LEAD + JITTER + SINK
_TICK = os.sysconf("SC_CLK_TCK")


def run() -> list[Row]:
    with tempfile.TemporaryDirectory(prefix="bench-audio-") as folder:
        server = SoundServer(Path(folder))
        before = {name: os.environ.get(name) for name in server.environment()}
        os.environ.update(server.environment())
        try:
            return both_ways(server, Path(folder) / "voice.log") + bad_network(server)
        finally:
            server.close()
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value


def both_ways(server: SoundServer, log: Path) -> list[Row]:
    with (
        private_master() as environment,
        Simulation("empty", port=0, speaker="robot_speaker") as robot,
        log.open("w") as output,
    ):
        ends = ("_microphone:=pilot_mic.monitor", "_speaker:=pilot_speaker")
        network = (f"--pip={robot.url}", f"_rtp_port:={free_port()}", f"_jitter:={JITTER}")
        node = processes.start(
            ["rosrun", "telepresence_1", "voice", *ends, *network],
            env={**environment, **server.environment()},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
        )
        said, mouth = Recorder(server, "pilot_mic.monitor"), Mouth(server, "pilot_mic")
        at_robot, at_pilot = (Recorder(server, f"{name}_speaker.monitor") for name in ("robot", "pilot"))
        try:
            return _measure(robot, node.pid, said, mouth, at_robot, at_pilot)
        except RuntimeError as error:
            raise RuntimeError(f"{error}\n{log.read_text()}") from error
        finally:
            for part in (said, mouth, at_robot, at_pilot):
                part.close()
            processes.end(node)


def _measure(
    robot: Simulation, node: int, said: Recorder, mouth: Mouth, at_robot: Recorder, at_pilot: Recorder
) -> list[Row]:
    ours, theirs = sentence(PILOT), sentence(ROOM, "en-gb")
    period = max(len(ours), len(theirs)) / RATE + 1.0

    def heard() -> bool:
        mouth.say(ours)
        robot.room.surroundings.play(theirs, RATE)
        time.sleep(period)
        return at_robot.level(2.0) > 0.005 and at_pilot.level(2.0) > 0.005

    wait_for(heard, "sound on both sides", 90.0)
    to_robot: list[tuple[float, float, float]] = []
    to_pilot: list[tuple[float, float, float]] = []
    begin, busy = time.monotonic(), _processor(node)
    while time.monotonic() - begin < SECONDS:
        start = time.monotonic() + 0.05
        robot.room.surroundings.play(theirs, RATE, start)
        mouth.say(ours)
        time.sleep(period)
        likeness, place = match(ours, said.between(start - 0.2, start + period))
        if likeness > 0.98:  # else the playback itself was late
            to_robot += _pieces(ours, start - 0.2 + place, at_robot)
        to_pilot += _pieces(theirs, start, at_pilot)
        for ear in (said, at_robot, at_pilot):
            ear.forget(start - 1.0)
    share = (_processor(node) - busy) / (time.monotonic() - begin)
    return [
        *_rows("pilot to robot", to_robot, TO_ROBOT),
        *_rows("robot to pilot", to_pilot, TO_PILOT),
        Row("processor of the node, both ways", share, 1.0, "cores", "one core"),
    ]


def _pieces(sound: np.ndarray, start: float, ear: Recorder) -> list[tuple[float, float, float]]:
    """(moment, likeness, delay [s]) of every loud piece."""
    count, found = int(PIECE * RATE), []
    for first in range(0, len(sound) - count + 1, count):
        part = sound[first : first + count]
        if np.sqrt(np.mean(part**2)) > 0.02:
            at = start + first / RATE
            likeness, delay = match(part, ear.between(at, at + PIECE + LATEST))
            found.append((at, likeness, delay))
    return found


def _rows(way: str, pieces: list[tuple[float, float, float]], configured: float) -> list[Row]:
    delays = [delay for _, likeness, delay in pieces if likeness > 0.5]
    whole = sum(likeness > WHOLE for _, likeness, _ in pieces)
    fifth = max(1, len(delays) // 5)
    growth = float(np.median(delays[-fifth:]) - np.median(delays[:fifth]))
    seconds = pieces[-1][0] - pieces[0][0]
    name = "set latency"
    return [
        Row(f"{way}, delay p50", percentile(delays, 50) * 1e3, configured * 1e3, "ms", name),
        Row(f"{way}, delay p95", percentile(delays, 95) * 1e3, configured * 1e3, "ms", name),
        Row(f"{way}, growth of the delay in {seconds:.0f} s", growth * 1e3, configured * 1e3, "ms", name),
        Row(f"{way}, likeness, median", float(np.median([p[1] for p in pieces])), 1.0, "", "the same sound"),
        Row(f"{way}, pieces heard", len(delays) / len(pieces), 1.0, "", "pieces said"),
        Row(f"{way}, pieces without a hole", whole / len(pieces), 1.0, "", "pieces said"),
    ]


def bad_network(server: SoundServer) -> list[Row]:
    """A network with 2 % loss and 50 ms of jitter and one without, then a cut."""
    sinks = dict(zip(rtp_sound.CODECS, ("pilot_speaker", "robot_speaker"), strict=True))
    lines = {codec: Line(server, codec, sink, free_port()) for codec, sink in sinks.items()}
    clear = Line(server, "l16", "robot_mic", free_port(), loss=0.0, jitter=0.0)
    talk = Talk([clear, *lines.values()])
    try:
        for line in (clear, *lines.values()):
            wait_for(lambda line=line: line.ear.level() > 0.01, "sound through the bad network")
        begin = time.monotonic()
        time.sleep(20.0)
        end = time.monotonic() - LONGEST
        whole = float(np.median(list(talk.likeness(clear, begin, end).values())))
        rows = []
        for codec, line in lines.items():
            played, missing = line.player.packets()
            likeness = float(np.median(list(talk.likeness(line, begin, end).values())))
            name = f"{codec}, 2 % loss, 50 ms jitter"
            rows += [
                Row(f"{name}: likeness, median", likeness, whole, "", "L16 without loss and jitter"),
                Row(f"{name}: packets to conceal", 100 * missing / (played + missing), 2.0, "%", "lost on the way"),
            ]
        return rows + _after_a_cut(lines)
    finally:
        talk.close()
        for line in (clear, *lines.values()):
            line.close()


def _after_a_cut(lines: dict[str, Line]) -> list[Row]:
    for line in lines.values():
        line.network.cut = True
    time.sleep(CUT)
    begin = time.monotonic()
    for line in lines.values():
        line.network.cut = False
    back: dict[str, float] = {}

    def watch(codec: str, heard: Callable[[], bool]) -> None:
        wait_for(heard, f"{codec} after the cut")
        back[codec] = time.monotonic() - begin

    threads = [
        threading.Thread(target=watch, args=(codec, lambda line=line: line.ear.level(0.05) > 0.01))
        for codec, line in lines.items()
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [
        Row(f"{codec}: sound again after {CUT:.0f} s of a cut", back[codec] * 1e3, 1000.0, "ms", "one second")
        for codec in lines
    ]


def _processor(pid: int) -> float:
    """Seconds of processor time that a program and its children have used."""
    total = 0.0
    for number in (pid, *processes.descendants(pid)):
        try:
            fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        total += (int(fields[11]) + int(fields[12])) / _TICK
    return total
