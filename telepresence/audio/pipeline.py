"""A GStreamer pipeline that is kept running: opened, watched, closed on an error, opened again.

GStreamer reports what goes wrong on a bus that nobody has to read, and links that cannot be made return False. Here a
description is parsed as a whole, which fails loudly, and every error on the bus ends the run with its text.
"""

from __future__ import annotations

import ctypes
import logging
import threading
from collections.abc import Callable

# GStreamer loads libunwind, whose unwinder would then serve all C++ libraries that are loaded later, and the first C++
# exception of libqi or of greenlet ends the program. So the compiler's own unwinder is there for all of them before.
ctypes.CDLL("libgcc_s.so.1", mode=ctypes.RTLD_GLOBAL)
import gi  # noqa: E402

gi.require_version("Gst", "1.0")
from gi.repository import GLib, Gst  # noqa: E402

log = logging.getLogger(__name__)

RETRY_PERIOD = 2.0
"""Seconds between two attempts to open a pipeline that cannot be opened."""
START_TIMEOUT = 5.0
STEADY_AFTER = 3.0
"""A pipeline that ran this long [s] counts as having worked: its next failure is reported again."""
NOT_STARTED = "not started yet"
_POLL = 100 * Gst.MSECOND
_WATCHED = (
    Gst.MessageType.ERROR
    | Gst.MessageType.EOS
    | Gst.MessageType.ELEMENT
    | Gst.MessageType.LATENCY
    | Gst.MessageType.CLOCK_LOST
)
SILENCE = -100.0
"""What a level meter shows for digital silence [dBFS]."""

Gst.init(None)


class SoundError(RuntimeError):
    """Sound cannot be captured or played; the text says why and what to do."""


class NoSoundDevice(SoundError):
    """There is nothing to capture or to play with, or nothing is wanted: no fault, and windows and pages show it."""


class KeptPipeline:
    """One pipeline, on a thread of its own.

    Args:
        name: Of the thread, and in messages.
        describe: Returns the description (gst-launch syntax) for the next attempt. Raises SoundError with a reason.
        prepare: Gets every new pipeline before it starts, to connect callbacks.
        on_level: Gets the loudest channel's mean level [dBFS] from an element `level`, if the description holds one.
        on_state: Called with None when sound flows, or with the reason why it does not.
    """

    def __init__(
        self,
        name: str,
        describe: Callable[[], str],
        prepare: Callable[[Gst.Pipeline], None] = lambda pipeline: None,
        on_level: Callable[[float], None] = lambda level: None,
        on_state: Callable[[str | None], None] = lambda problem: None,
    ) -> None:
        self.problem: str | None = NOT_STARTED
        """Why no sound flows; None while it does, or is not wanted."""
        self.name = name
        self.runs = 0
        """How often it was started successfully."""
        self._describe, self._prepare = describe, prepare
        self._on_level, self._on_state = on_level, on_state
        self._pipeline: Gst.Pipeline | None = None
        self._reported: str | None = None
        self._wanted = True
        self._again = threading.Event()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> KeptPipeline:
        self._thread.start()
        return self

    @property
    def wanted(self) -> bool:
        """Whether there is to be a pipeline; while it is not, no device is open."""
        return self._wanted

    @wanted.setter
    def wanted(self, wanted: bool) -> None:
        if wanted is not self._wanted:
            self._wanted = wanted
            self.problem = NOT_STARTED if wanted else None
            self._again.set()

    def reopen(self) -> None:
        """Close it and start again from a new description: another device was chosen."""
        self._again.set()

    def close(self) -> None:
        self._stop.set()
        self._again.set()
        if self._thread.ident is not None:
            self._thread.join(timeout=START_TIMEOUT + 1.0)

    def get(self, element: str) -> Gst.Element | None:
        """Return an element of the running pipeline by name; None while none runs."""
        pipeline = self._pipeline
        return pipeline.get_by_name(element) if pipeline is not None else None

    def _run(self) -> None:
        while not self._stop.is_set():
            self._again.clear()
            if not self._wanted:
                self.problem = self._reported = None
                self._again.wait()
                continue
            try:
                ran = self._once()
            except SoundError as error:
                self._report(str(error), logging.INFO if isinstance(error, NoSoundDevice) else logging.WARNING)
                self._again.wait(RETRY_PERIOD)
                continue
            except Exception:  # the top of a thread that has to go on: callbacks are other people's code
                log.exception("%s fails", self.name)
                self._report("it fails; the log says why")
                self._again.wait(RETRY_PERIOD)
                continue
            if ran is not None:
                self._report(ran)
                self._again.wait(RETRY_PERIOD)

    def _once(self) -> str | None:
        """Run one pipeline until it fails (return the reason), or until it is to be closed or reopened (None)."""
        description = self._describe()
        try:
            pipeline = Gst.parse_launch(description)
        except GLib.Error as error:
            raise SoundError(f"GStreamer cannot build it: {error.message} (apt-get install gstreamer1.0-*)") from None
        bus = pipeline.get_bus()
        try:
            self._prepare(pipeline)
            if pipeline.set_state(Gst.State.PLAYING) == Gst.StateChangeReturn.FAILURE:
                message = bus.timed_pop_filtered(0, Gst.MessageType.ERROR)
                raise SoundError(_text(message) if message else "it does not start")
            self._pipeline = pipeline
            return self._watch(pipeline, bus)
        finally:
            self._pipeline = None
            pipeline.set_state(Gst.State.NULL)

    def _watch(self, pipeline: Gst.Pipeline, bus: Gst.Bus) -> str | None:
        self.problem = None
        self.runs += 1
        self._on_state(None)
        clock = Gst.SystemClock.obtain()
        begin = clock.get_time()
        while not self._again.is_set():
            if self._reported is not None and clock.get_time() - begin > STEADY_AFTER * Gst.SECOND:
                log.info("%s: sound again", self.name)
                self._reported = None
            message = bus.timed_pop_filtered(_POLL, _WATCHED)
            if message is None:
                continue
            if message.type == Gst.MessageType.ERROR:
                return _text(message)
            if message.type == Gst.MessageType.EOS:
                return "the source ended"
            if message.type == Gst.MessageType.LATENCY:
                pipeline.recalculate_latency()
            elif message.type == Gst.MessageType.CLOCK_LOST:
                return "the sound device's clock stopped"
            elif message.has_name("level"):
                # GValueArray has no binding that PyGObject can read without a deprecation; its text has the numbers.
                self._on_level(_loudest(message.get_structure()))
        return None

    def _report(self, problem: str, level: int = logging.WARNING) -> None:
        self.problem = problem
        self._on_state(problem)
        if problem != self._reported and not self._stop.is_set():
            log.log(level, "%s: %s; trying again until it works", self.name, problem)
            self._reported = problem


def _loudest(structure: Gst.Structure) -> float:
    return max(SILENCE, *structure.get_value("rms"), SILENCE)


def _text(message: Gst.Message) -> str:
    error, _debug = message.parse_error()
    return f"{message.src.get_name()}: {error.message}"
