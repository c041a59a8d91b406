"""ALMotion's list of motions: which joints each one has booked, and which motions wait for their turn."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from pepper_sim.body.joints import resolve


@dataclass(frozen=True, eq=False)
class Task:
    """A motion that runs: the joints, or "Base", that it uses, how to end it, and whether others wait for it."""

    name: str
    identity: int
    resources: tuple[str, ...]
    end: Callable[[], Any]
    yields: bool = False


@dataclass(eq=False)
class _Booking:
    """A motion that runs or waits: what starts it, the motion once started, and what its caller waits for."""

    name: str
    identity: int
    resources: frozenset[str]
    order: tuple[str, ...]
    start: Callable[[], Future]
    yields: bool
    answer: Future
    motion: Future | None = None
    ended: bool = False


class MotionTasks:
    """The motions, as ALMotion.getTaskList lists those that run.

    A motion books its joints. One whose joints are taken is postponed until they are free, in the order of the calls
    (NAOqi 2.8 documentation, tools-motion-task).
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._added: dict[int, Task] = {}
        self._running: dict[int, _Booking] = {}
        self._waiting: list[_Booking] = []
        self._numbers = itertools.count(1)
        self._closed = False

    # --- starting ----------------------------------------------------------------------------------------------------

    def add(self, name: str, resources: Iterable[str], future: Future, end: Callable[[], Any]) -> Future:
        """List a motion that runs already until `future` is done; returns `future`. `end` ends the motion early."""
        task = Task(name, next(self._numbers), tuple(resources), end)
        with self._lock:
            self._added[task.identity] = task
        future.add_done_callback(lambda _: self._forget(task))
        return future

    def book(self, name: str, resources: Iterable[str], start: Callable[[], Future], *, yields: bool = False) -> Future:
        """Run a motion as soon as its resources are free.

        Args:
            start: Starts the motion; returns a future that is true when it is done, and whose cancelling ends it.
            yields: Another motion of the same resources ends this one instead of waiting for it.
        Returns:
            Future: Whether the motion was carried out to its end; cancelling it ends the motion, started or not.
        """
        order = tuple(resources)
        booking = _Booking(name, next(self._numbers), frozenset(order), order, start, yields, Future())
        booking.answer.add_done_callback(lambda done: self._end(booking) if done.cancelled() else None)
        with self._lock:
            earlier = [*self._running.values(), *self._waiting]
            self._waiting.append(booking)
            closed = self._closed
        if closed:
            self.drop_waiting()()
        for other in earlier:
            if other.yields and other.resources & booking.resources:
                self._end(other)
        self._start_what_can()
        return booking.answer

    # --- listing and ending ------------------------------------------------------------------------------------------

    def all(self) -> list[Task]:
        """Return what runs, oldest first."""
        with self._lock:
            started = [booking for booking in self._running.values() if booking.motion is not None]
            tasks = [*self._added.values(), *(self._task(booking) for booking in started)]
        return sorted(tasks, key=lambda task: task.identity)

    def using(self, resources: Iterable[str]) -> list[Task]:
        """Return the running motions that use one of `resources` and do not yield."""
        wanted = set(resources)
        return [task for task in self.all() if wanted & set(task.resources) and not task.yields]

    def kill(self, identity: int) -> bool:
        """End one running motion; false if there is none of that number."""
        task = next((task for task in self.all() if task.identity == identity), None)
        if task is None:
            return False
        task.end()
        return True

    def end_using(self, resources: Iterable[str], *, sparing: str = "") -> None:
        """End the motions that use one of `resources` and those that wait for it, but those of the name `sparing`."""
        wanted = set(resources)
        with self._lock:  # what waits first, or it would start in the place of what ends
            bookings = [b for b in (*self._waiting, *self._running.values()) if b.name != sparing]
            added = [t for t in self._added.values() if wanted & set(t.resources) and t.name != sparing]
        for booking in bookings:
            if wanted & booking.resources:
                self._end(booking)
        for task in added:
            task.end()

    def drop_waiting(self) -> Callable[[], None]:
        """Start none of the motions that wait now; return what answers their calls."""
        with self._lock:
            waiting, self._waiting = self._waiting, []

        def answer() -> None:
            for booking in waiting:
                resolve(booking.answer, False)

        return answer

    def close(self) -> None:
        """Start no more motions."""
        with self._lock:
            self._closed = True
        self.drop_waiting()()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _task(self, booking: _Booking) -> Task:
        return Task(booking.name, booking.identity, booking.order, lambda: self._end(booking), booking.yields)

    def _start_what_can(self) -> None:
        while (booking := self._next()) is not None:
            self._begin(booking)

    def _next(self) -> _Booking | None:
        """Take the first motion whose resources are neither in use nor wanted by one that asked earlier."""
        with self._lock:
            taken = frozenset().union(*(booking.resources for booking in self._running.values()))
            for booking in self._waiting:
                if not taken & booking.resources:
                    self._waiting.remove(booking)
                    self._running[booking.identity] = booking
                    return booking
                taken |= booking.resources
        return None

    def _begin(self, booking: _Booking) -> None:
        try:
            motion = booking.start()
        except Exception as error:  # its caller gets it; the joints must become free all the same
            self._release(booking)
            if booking.answer.set_running_or_notify_cancel():
                booking.answer.set_exception(error)
            return
        with self._lock:
            booking.motion = motion
            ended = booking.ended
        motion.add_done_callback(lambda done: self._finish(booking, done))
        if ended:
            motion.cancel()

    def _finish(self, booking: _Booking, done: Future) -> None:
        self._release(booking)
        resolve(booking.answer, not done.cancelled() and bool(done.result()))
        self._start_what_can()

    def _end(self, booking: _Booking) -> None:
        with self._lock:
            waited = booking in self._waiting
            if waited:
                self._waiting.remove(booking)
            booking.ended = True
            motion = booking.motion
        if motion is not None:
            motion.cancel()
        if waited:
            resolve(booking.answer, False)
            self._start_what_can()  # what stood behind it may have waited for nothing else

    def _release(self, booking: _Booking) -> None:
        with self._lock:
            self._running.pop(booking.identity, None)

    def _forget(self, task: Task) -> None:
        with self._lock:
            self._added.pop(task.identity, None)
