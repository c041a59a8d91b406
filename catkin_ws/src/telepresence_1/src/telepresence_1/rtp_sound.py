"""Sound over RTP: from the program that receives the robot's sound to the pilot's loudspeaker, here or elsewhere.

Wire, UDP, default port 10001, payload type 96:
    l16   RFC 3551 L16/44100/2: what the first telepresence rig sent; 1.5 Mbit/s, a packet every 8 ms
    opus  RFC 7587; 0.1 Mbit/s, a packet every 10 ms, lost ones are rebuilt from the next one or concealed
Both sides are plain GStreamer; `gst-launch-1.0` can take either place. RTP itself proves nothing about who sends it: a
player beside its sender takes packets of that sender alone, one on another machine belongs in a VPN.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable

import numpy as np
from gi.repository import Gio

from telepresence import ports
from telepresence.audio.output import Output
from telepresence.audio.pipeline import Gst, KeptPipeline, SoundError
from telepresence.audio.schedule import Schedule
from telepresence_1.network import NoRoute, local_address_towards

CODECS = ("l16", "opus")
LEAD = 0.015
"""Seconds that a block waits before its first packet leaves: what the next block may be late without a gap."""
MAX_LEAD = 0.1
"""A block that would wait longer [s] is thrown away: blocks came in a burst after a pause."""
SETTLE = 0.8
"""Seconds at the beginning in which the pace is found and nothing is sent."""
_GAP = 7_000_000
"""A hole longer than this [ns], which one packet of 8 ms is, becomes silence of its length; by default holes below
40 ms are cut out, which shifts everything after a lost packet."""
_LEVEL = "level name=level interval=100000000 post-messages=true"
ENCODERS = {
    "l16": "audio/x-raw,format=S16BE,rate=44100,channels=2 ! rtpL16pay pt=96",
    "opus": "audio/x-raw,rate=48000,channels=2 ! opusenc bitrate=96000 frame-size=10 inband-fec=true "
    "packet-loss-percentage=5 ! rtpopuspay pt=96",
}
CAPS = {
    "l16": "application/x-rtp,media=audio,clock-rate=44100,encoding-name=L16,encoding-params=(string)2,channels=2,"
    "payload=96",
    "opus": "application/x-rtp,media=audio,clock-rate=48000,encoding-name=OPUS,payload=96",
}
_DECODERS = {"l16": "rtpL16depay", "opus": "rtpopusdepay ! opusdec plc=true use-inband-fec=true"}


def receive(codec: str, jitter: float) -> str:
    """Turn packets into even sound (gst-launch syntax): put in order, concealed, silence of that length where it fails.

    Args:
        jitter: Seconds that a packet may be late.
    """
    return (
        f"rtpjitterbuffer name=jitter latency={round(jitter * 1000)} do-lost=true ! {_DECODERS[codec]} ! audioconvert "
        f"! audioresample ! audiorate skip-to-first=true tolerance={_GAP}"
    )


class RtpSender:
    """Sends blocks of sound at an even pace, however they arrive.

    Args:
        rate, channels: Of the blocks [Hz].
        host, port: Where the receiver listens.
        on_level: Gets the mean level [dBFS] ten times a second while sound is sent.
        patience: Seconds of delay accepted on top, for a busy machine.
    Attributes:
        origin: Address and port from which packets are sent, nobody else's until `close`.
    """

    def __init__(
        self,
        rate: int,
        channels: int,
        host: str = "127.0.0.1",
        port: int = ports.RTP_SOUND,
        codec: str = "l16",
        on_level: Callable[[float], None] = lambda level: None,
        patience: float = 0.0,
    ) -> None:
        self._rate = rate
        self._schedule = Schedule(LEAD + patience, MAX_LEAD + patience, SETTLE)
        self._lock = threading.Lock()
        description = (
            "appsrc name=in is-live=true format=time max-bytes=0 "
            f"caps=audio/x-raw,format=S16LE,rate={rate},channels={channels},layout=interleaved ! {_LEVEL} "
            f"! audioconvert ! audioresample ! {ENCODERS[codec]} ! udpsink name=out sync=true async=false "
            "processing-deadline=0"  # GStreamer's default would add 20 ms to every live sound
        )
        self._target = (host, port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((_address_towards(host), 0))
        self.origin = self._socket.getsockname()
        self.pipeline = KeptPipeline("sound of the robot", lambda: description, self._reset, on_level)

    def start(self) -> RtpSender:
        self.pipeline.start()
        return self

    def close(self) -> None:
        self.pipeline.close()
        self._socket.close()

    def push(self, block: np.ndarray, arrival: float) -> None:
        """Send a block of (n, channels) int16 that arrived at `arrival` [s, monotonic]."""
        source = self.pipeline.get("in")
        if source is None:
            return
        clock, base = source.get_clock(), source.get_base_time()
        if clock is None:
            return
        # GStreamer's system clock and time.monotonic() are the same clock.
        with self._lock:
            due, seam = self._schedule.place(arrival - base / Gst.SECOND, len(block) / self._rate)
        if due is None or due < 0.0:
            return
        buffer = Gst.Buffer.new_wrapped(np.ascontiguousarray(block).tobytes())
        buffer.pts = int(due * Gst.SECOND)
        buffer.duration = len(block) * Gst.SECOND // self._rate
        if seam:
            buffer.set_flags(Gst.BufferFlags.DISCONT)
        source.emit("push-buffer", buffer)

    def _reset(self, pipeline: Gst.Pipeline) -> None:
        out = pipeline.get_by_name("out")
        for name, value in zip(("host", "port"), self._target, strict=True):
            out.set_property(name, value)
        out.set_property("socket", _for_gstreamer(self._socket.dup()))
        with self._lock:
            self._schedule.forget()


class RtpPlayer(Output):
    """Plays what arrives.

    Args:
        address: Of this machine, on which packets are accepted; loopback by default.
        origin: Address and port of the only sender whose packets are taken; None takes everybody's.
        jitter: Seconds that a packet may be late.
        device, on_state, patience, via: See `Output`.
    """

    def __init__(
        self,
        device: str = "auto",
        address: str = "127.0.0.1",
        port: int = ports.RTP_SOUND,
        codec: str = "l16",
        jitter: float = 0.02,
        on_state: Callable[[str | None], None] = lambda problem: None,
        patience: float = 0.0,
        origin: tuple[str, int] | None = None,
        via: Callable[[str], str] = str,
    ) -> None:
        self._address, self._port, self._origin = address, port, origin
        head = f'udpsrc name=in port={port} reuse=false caps="{CAPS[codec]}" ! {receive(codec, jitter)}'
        super().__init__("loudspeaker", device, head, patience, self._listen, on_state=on_state, via=via)

    def packets(self) -> tuple[int, int]:
        """Return how many packets were played, and how many lost or late, since the pipeline started."""
        jitter = self.pipeline.get("jitter")
        if jitter is None:
            return 0, 0
        stats = jitter.get_property("stats")
        read = {name: int(stats.get_value(name) or 0) for name in ("num-pushed", "num-lost", "num-late")}
        return read["num-pushed"], read["num-lost"] + read["num-late"]

    def _listen(self, pipeline: Gst.Pipeline) -> None:
        source = pipeline.get_by_name("in")
        if self._origin is None:
            source.set_property("address", self._address)
        else:
            source.set_property("socket", _for_gstreamer(self._connect(self._origin)))

    def _connect(self, origin: tuple[str, int]) -> socket.socket:
        """A socket to which the kernel hands nothing but that sender's packets."""
        connected = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            connected.bind((self._address, self._port))
            connected.connect(origin)
        except OSError as error:
            connected.close()
            raise SoundError(f"{self._address}, port {self._port} (udp): {error.strerror}") from None
        return connected


def _address_towards(host: str) -> str:
    """Our address on the way to `host`; without a way yet, all that we have or get."""
    try:
        return local_address_towards(host)
    except NoRoute:
        return ""


def _for_gstreamer(made: socket.socket) -> Gio.Socket:
    """The same socket for an element, which closes it."""
    return Gio.Socket.new_from_fd(made.detach())
