"""The chosen microphone and loudspeaker as GStreamer elements.

A choice is one of

    auto          the sound server's default (PulseAudio, or PipeWire in its place), else ALSA's when there is a card
    NAME          a device of the sound server, as `pactl list short sources` or `... sinks` names it
    alsa:DEVICE   for example alsa:hw:1,0
    test          a microphone with a tone of 440 Hz, a loudspeaker that discards everything
    none          no device

Delays are short on purpose: PulseAudio's defaults alone are 200 ms in each direction.
"""

from __future__ import annotations

import re
from pathlib import Path

from telepresence.audio.pipeline import Gst, NoSoundDevice, SoundError

ALIGNMENT, ALIGNMENT_WAIT = 10_000_000, 200_000_000
"""Sound that has been off its time by the first for as long as the second is realigned [ns]."""
SOURCE_TIMES = "buffer-time=200000 latency-time=10000"
"""Microseconds. The second is the delay; the first is how long this program may be busy without losing sound."""
SINK_BUFFER = 0.025
"""Seconds of sound that a loudspeaker holds in advance: its delay, and how long this program may be busy."""
_NAME = re.compile(r"[\w.:@+,-]{1,200}")
_CARDS = Path("/proc/asound/cards")


def source(choice: str) -> str:
    """Return the element that captures from the chosen microphone.

    Raises:
        SoundError: There is none, or the choice is no device's name.
    """
    if choice == "test":
        return f"audiotestsrc is-live=true freq=440 volume=0.1 samplesperbuffer={48000 // 100}"
    return f"{_element('src', choice, 'microphone')} {SOURCE_TIMES}"


def sink(choice: str, patience: float = 0.0) -> str:
    """Return the element that plays on the chosen loudspeaker, in time with the clock (sync=true).

    Args:
        patience: Seconds on top of `SINK_BUFFER`, for a busy machine.
    Raises:
        SoundError: There is none, or the choice is no device's name.
    """
    if choice == "test":
        return "fakesink sync=true"
    times = f"buffer-time={round((SINK_BUFFER + patience) * 1e6)} latency-time=5000"
    # GStreamer's default deadline would add 20 ms to every live sound, and what a hiccup made late by less than its
    # default of 40 ms would stay late for good.
    in_time = f"processing-deadline=0 alignment-threshold={ALIGNMENT} discont-wait={ALIGNMENT_WAIT}"
    return f"{_element('sink', choice, 'loudspeaker')} {times} {in_time}"


def _element(kind: str, choice: str, what: str) -> str:
    choice = choice or "auto"
    if choice == "none":
        raise NoSoundDevice(f"no {what}, as chosen")
    device = choice.removeprefix("alsa:")
    if not _NAME.fullmatch(device):
        raise SoundError(f"'{choice}' is no {what}: choose auto, none, test, alsa:DEVICE or a sound server's device")
    if choice.startswith("alsa:"):
        return f'alsa{kind} device="{device}"'
    if _server_answers():
        return f"pulse{kind}" if choice == "auto" else f'pulse{kind} device="{device}"'
    if choice == "auto" and _has_card():
        return f"alsa{kind}"
    problem = f"no {what}: no sound server (PulseAudio, PipeWire) answers"
    if choice == "auto":
        raise NoSoundDevice(f"{problem} and there is no sound card")
    raise SoundError(problem)


def _server_answers() -> bool:
    """Whether a PulseAudio server lets us in: the element connects when it becomes ready.

    The sink asks for microphones, too: whenever no server answers, GStreamer 1.22's pulsesrc leaves a thread and two
    descriptors behind."""
    element = Gst.ElementFactory.make("pulsesink")
    if element is None:
        return False
    try:
        return element.set_state(Gst.State.READY) != Gst.StateChangeReturn.FAILURE
    finally:
        element.set_state(Gst.State.NULL)


def _has_card() -> bool:
    try:
        return "[" in _CARDS.read_text()
    except OSError:
        return False


def names() -> dict[str, list[str]]:
    """Return the names that can be chosen on the sound server: {"microphones": [...], "loudspeakers": [...]}."""
    found: dict[str, list[str]] = {"microphones": [], "loudspeakers": []}
    if not _server_answers():  # without one, every start of the monitor leaves three descriptors behind
        return found
    monitor = Gst.DeviceMonitor.new()
    monitor.add_filter("Audio/Source", None)
    monitor.add_filter("Audio/Sink", None)
    monitor.start()
    try:
        for device in monitor.get_devices():
            element = device.create_element(None)
            name = element.get_property("device") if element and element.find_property("device") else None
            if name:
                found["loudspeakers" if device.has_classes("Sink") else "microphones"].append(name)
        return found
    finally:
        monitor.stop()
