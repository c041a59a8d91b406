"""Runs a behaviour: signals travel along the links from box to box until the root box says that it is over."""

from __future__ import annotations

import functools
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Protocol

from pepper_sim.animations.behavior import CONTAINER, LOAD, START, STOP, STOPPED, Box, Diagram
from pepper_sim.animations.timeline import Timeline


class Script(Protocol):
    """The script of one box, loaded."""

    def receive(self, name: str, value: Any) -> None:
        """Handle a signal at the input `name`; returns at once."""

    def unload(self) -> None:
        """End what it does; called once."""


class Stage(Protocol):
    """What a behaviour acts on."""

    def play(self, timeline: Timeline) -> Future:
        """Start a timeline; the future is done at its end, and cancelling it ends it."""

    def load(self, box: Box, emit: Callable[[str, Any], None]) -> Script:
        """Load the script of a box; it calls `emit(output, value)`, on any thread."""


class Flow:
    """One run of a behaviour.

    Args:
        root: Its root box.
        stage: What it acts on.
    """

    def __init__(self, root: Box, stage: Stage) -> None:
        self._stage = stage
        self._events: queue.Queue[Callable[[], None] | None] = queue.Queue()
        self._root = _Active(self, root, None, CONTAINER, None)
        self._over = False

    def run(self) -> None:
        """Start the root box and return when it is over or `stop` was called. What a script raises ends it, too."""
        try:
            self._root.start_by_nature()
            while not self._over:
                event = self._events.get()
                if event is None:
                    break
                event()
        finally:
            self._over = True
            self._root.end()

    def stop(self) -> None:
        """End the behaviour; from any thread."""
        self._events.put(None)

    # --- for the boxes -----------------------------------------------------------------------------------------------

    @property
    def stage(self) -> Stage:
        return self._stage

    def later(self, event: Callable[[], None]) -> None:
        """Do something on the thread of `run`."""
        self._events.put(event)

    def finished(self) -> None:
        """The root box is over."""
        self._over = True


class _Active:
    """A box of a running behaviour. Used by the thread of `Flow.run` only."""

    def __init__(self, flow: Flow, box: Box, holder: _Active | None, number: int, diagram: Diagram | None) -> None:
        self._flow = flow
        self._box = box
        self._holder = holder
        self._number = number
        self._diagram = diagram
        """The diagram in which the box stands."""
        self._inside: list[tuple[Diagram, dict[int, _Active]]] = []
        self._script: Script | None = None
        self._motion: Future | None = None
        self._timers: list[threading.Timer] = []
        self._running = False

    def start_by_nature(self) -> None:
        """Start as if a signal came to the input that starts the box."""
        for number, port in self._box.inputs.items():
            if port.nature == START:
                self.receive(number, None)
                return
        self._start(None)

    def receive(self, number: int, value: Any) -> None:
        """Handle a signal at an input."""
        port = self._box.inputs.get(number)
        if port is None:
            return
        if self._box.script:
            if self._script is None:
                self._script = self._flow.stage.load(self._box, self._emit_later)
            self._script.receive(port.name, value)
        if port.nature == START:
            self._start(value)
        elif port.nature != STOP and self._box.timeline is None and not self._running:
            self._start(value)  # whatever arrives wakes the diagram of a box without a timeline
        for diagram, boxes in list(self._inside):
            self._forward(diagram, boxes, CONTAINER, number, value)
        if port.nature == STOP and not self._box.script:
            self._finish()

    def end(self) -> None:
        """Stop everything inside, without a signal."""
        self._running = False
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        motion, self._motion = self._motion, None
        if motion is not None:
            motion.cancel()
        inside, self._inside = self._inside, []
        for _, boxes in inside:
            for box in boxes.values():
                box.end()
        script, self._script = self._script, None
        if script is not None:
            script.unload()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _start(self, value: Any) -> None:
        if self._running:
            if self._box.timeline is None:
                return  # its diagram gets the signal from `receive`
            self.end()
        self._running = True
        if self._box.timeline is None:
            for _, diagram in self._box.diagrams:
                self._open(diagram)
            return
        self._motion = motion = self._flow.stage.play(self._box.timeline)
        motion.add_done_callback(lambda done: self._flow.later(lambda: self._played(done)))
        for moment, diagram in self._box.diagrams:
            enter = functools.partial(self._enter, diagram, value)
            timer = threading.Timer(moment, self._flow.later, [enter])
            timer.daemon = True
            self._timers.append(timer)
            timer.start()

    def _open(self, diagram: Diagram) -> dict[int, _Active]:
        boxes = {number: _Active(self._flow, box, self, number, diagram) for number, box in diagram.boxes.items()}
        self._inside.append((diagram, boxes))
        return boxes

    def _enter(self, diagram: Diagram, value: Any) -> None:
        """Start a diagram of the timeline, whose frame has come."""
        if not self._running:
            return
        boxes = self._open(diagram)
        for number, port in self._box.inputs.items():
            if port.nature in (LOAD, START):
                self._forward(diagram, boxes, CONTAINER, number, value)

    def _played(self, motion: Future) -> None:
        if motion is self._motion:
            self._motion = None
            self._finish()

    def _finish(self) -> None:
        if not self._running:
            return
        self.end()
        for number, port in self._box.outputs.items():
            if port.nature == STOPPED:
                self._emit(number, None)

    def _emit_later(self, name: str, value: Any) -> None:
        for number, port in self._box.outputs.items():
            if port.name == name:
                self._flow.later(functools.partial(self._emit, number, value))

    def _emit(self, number: int, value: Any) -> None:
        """Send a signal from an output to what it is linked with."""
        if self._holder is None or self._diagram is None:
            if self._box.outputs[number].nature == STOPPED:
                self._flow.finished()
            return
        for diagram, boxes in self._holder._inside:
            if diagram is self._diagram and boxes.get(self._number) is self:
                self._holder._forward(diagram, boxes, self._number, number, value)
                return

    def _forward(self, diagram: Diagram, boxes: dict[int, _Active], source: int, output: int, value: Any) -> None:
        for link in diagram.links:
            if (link.source, link.output) != (source, output):
                continue
            if link.target != CONTAINER:
                target = boxes.get(link.target)
                if target is not None:
                    self._flow.later(functools.partial(target.receive, link.input, value))
            elif link.input in self._box.outputs:
                if self._box.outputs[link.input].nature == STOPPED:
                    self.end()
                self._emit(link.input, value)
