"""What becomes of speech on a bad network, at times that are decided here: no machine is too busy for it.

The sound is packed as `RtpSender` packs it and unpacked as `RtpPlayer` unpacks it; between them packets get lost and
held back by a seeded chance, and the clock of the receiving half is GStreamer's test clock.
"""

from __future__ import annotations

import random
import time
from collections.abc import Iterable

import gi
import numpy as np
from sound_lab import RATE, match
from telepresence_1.rtp_sound import CAPS, ENCODERS, receive

from telepresence.audio.pipeline import Gst

gi.require_version("GstCheck", "1.0")
from gi.repository import GstCheck  # noqa: E402

PIECE = 0.5
"""Seconds of speech that are compared at once."""
_BLOCK = 4096
"""Samples at once, as the robot's microphones deliver them."""
_DEADLINE = 60.0


def pack(sound: np.ndarray, codec: str) -> list[tuple[float, bytes]]:
    """(moment [s], RTP packet) for mono float32 samples at `RATE`."""
    pipeline = Gst.parse_launch(
        f"appsrc name=in format=time max-bytes=0 caps=audio/x-raw,format=S16LE,rate={RATE},channels=2,"
        f"layout=interleaved ! audioconvert ! audioresample ! {ENCODERS[codec]} ! appsink name=out sync=false"
    )
    source, sink = pipeline.get_by_name("in"), pipeline.get_by_name("out")
    pipeline.set_state(Gst.State.PLAYING)
    try:
        pcm = np.repeat((sound * 32767).astype("<i2"), 2)
        for first in range(0, len(sound), _BLOCK):
            buffer = Gst.Buffer.new_wrapped(pcm[2 * first : 2 * (first + _BLOCK)].tobytes())
            buffer.pts = first * Gst.SECOND // RATE
            source.emit("push-buffer", buffer)
        source.emit("end-of-stream")
        packets = []
        while (sample := sink.emit("pull-sample")) is not None:
            buffer = sample.get_buffer()
            packets.append((buffer.pts / Gst.SECOND, buffer.extract_dup(0, buffer.get_size())))
        return packets
    finally:
        pipeline.set_state(Gst.State.NULL)


def spoil(
    packets: Iterable[tuple[float, bytes]], loss: float, jitter: float, cut: tuple[float, float] = (0.0, 0.0)
) -> list[tuple[float, bytes]]:
    """(arrival [s], packet), in the order of arrival.

    Args:
        loss: Share of packets that vanish.
        jitter: Each is held back for a random time up to this [s], so that some overtake others.
        cut: From when to when nothing gets through [s].
    """
    chance = random.Random(1)
    arrivals = [(moment + chance.random() * jitter, packet) for moment, packet in packets if chance.random() >= loss]
    return sorted((at, packet) for at, packet in arrivals if not cut[0] <= at < cut[1])


def unpack(arrivals: list[tuple[float, bytes]], codec: str, late: float) -> np.ndarray:
    """Return what the player puts out, mono float32 at `RATE`, from the first packet on.

    Args:
        late: What the receiver allows for jitter [s].
    """
    pipeline = Gst.parse_launch(
        f"{receive(codec, late)} ! audioconvert ! audio/x-raw,format=S16LE,rate={RATE},channels=1 "
        "! appsink name=out sync=false async=false"
    )
    clock = GstCheck.TestClock.new()
    pipeline.use_clock(clock)
    pipeline.set_start_time(Gst.CLOCK_TIME_NONE)
    pipeline.set_base_time(0)
    pipeline.set_state(Gst.State.PLAYING)
    entrance = pipeline.get_by_name("jitter").get_static_pad("sink")
    segment = Gst.Segment()
    segment.init(Gst.Format.TIME)
    for event in (
        Gst.Event.new_stream_start("replay"),
        Gst.Event.new_caps(Gst.Caps.from_string(CAPS[codec])),
        Gst.Event.new_segment(segment),
    ):
        entrance.send_event(event)

    def pass_time(now: float) -> None:
        moment = int(now * Gst.SECOND)
        while (due := clock.get_next_entry_time()) <= moment:
            clock.set_time(max(due, clock.get_time()))
            clock.process_next_clock_id()
        clock.set_time(max(moment, clock.get_time()))

    try:
        for at, packet in arrivals:
            pass_time(at)
            buffer = Gst.Buffer.new_wrapped(packet)
            buffer.pts = buffer.dts = int(at * Gst.SECOND)
            entrance.chain(buffer)
        now, deadline = arrivals[-1][0], time.monotonic() + _DEADLINE
        entrance.send_event(Gst.Event.new_eos())
        sink, heard = pipeline.get_by_name("out"), []
        while not sink.get_property("eos"):
            if (sample := sink.emit("try-pull-sample", Gst.SECOND // 100)) is not None:
                buffer = sample.get_buffer()
                heard.append(np.frombuffer(buffer.extract_dup(0, buffer.get_size()), "<i2"))
            else:
                now += 0.01
                pass_time(now)
            if time.monotonic() > deadline:
                raise RuntimeError("the receiving half does not come to its end")
        return np.concatenate(heard).astype(np.float32) / 32768.0
    finally:
        pipeline.set_state(Gst.State.NULL)


def likeness(said: np.ndarray, heard: np.ndarray, begin: float, end: float) -> list[float]:
    """Compare every loud piece said between two moments [s] with what came within a fifth of a second of its place."""
    found, around = [], 0.2
    for at in np.arange(begin, end - PIECE, PIECE):
        part = said[round(at * RATE) : round((at + PIECE) * RATE)]
        if np.sqrt(np.mean(part**2)) > 0.02:
            place = slice(round((at - around) * RATE), round((at + PIECE + around) * RATE))
            found.append(match(part, heard[place])[0])
    return found
