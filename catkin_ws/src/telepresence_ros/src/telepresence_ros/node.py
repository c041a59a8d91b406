"""The base of every ROS node: a master that may come and go, logs, loops in threads of their own, an orderly end."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator

import rospy

from telepresence.security.private_files import restrict_new_files
from telepresence.station import heartbeat
from telepresence.station.ros_master import end_code
from telepresence.stop_signals import stop_on
from telepresence_ros.logs import close_log_folder, log_without_master, route_logs_to_ros
from telepresence_ros.master_watch import START_TIMEOUT, MasterWatch, wait_for_master
from telepresence_ros.namesake import give_way, remember_to_give_way
from telepresence_ros.prompt_sending import send_promptly
from telepresence_ros.sim_time import warn_without_clock
from telepresence_ros.single_connections import connect_once
from telepresence_ros.sockets import narrow_sockets

SHUTDOWN_TIMEOUT = 2.0
"""Seconds within which all loops together must end."""
ENDING_TIMEOUT = 5.0
"""Seconds that an ending node has in all, before it counts as frozen."""
ROBOT_PATIENCE = 5.0
"""Seconds that a loop which asks a robot may wait for it: the calls have time-outs of their own, which are shorter."""
_SPIN_PERIOD = 0.2


class Node:
    """A ROS node: waits for the master, survives its restart, and ends in order.

    Args:
        name: The node's name, unless the launch file gives another.
        on_master_lost: Called when the ROS master does not answer any more.
        stop: An event that the program's own signal handlers set, see `stop_on_signals`; rospy then handles no signals.
        master_timeout: How long to wait for a master at the start [s].

    Raises:
        SystemExit: There is no ROS master.
    """

    shutdown_timeout = SHUTDOWN_TIMEOUT
    patience = heartbeat.WITHIN
    """Seconds by which a cycle of a loop may be late before the node counts as frozen."""

    def __init__(
        self,
        name: str,
        on_master_lost: Callable[[], None] | None = None,
        stop: threading.Event | None = None,
        master_timeout: float = START_TIMEOUT,
    ) -> None:
        restrict_new_files()
        close_log_folder()
        wait_for_master(master_timeout, stop)
        give_way(name, stop or threading.Event())
        narrow_sockets()
        send_promptly()
        connect_once()
        rospy.init_node(name, disable_signals=stop is not None)
        log_without_master()
        remember_to_give_way()
        route_logs_to_ros()
        self.stop = stop or threading.Event()
        """Set when the node ends."""
        warn_without_clock(self.stop)
        self.master = MasterWatch(on_lost=on_master_lost).start()
        self._threads: list[threading.Thread] = []
        self._closers: list[Callable[[], None]] = []
        self._failed = threading.Event()
        self._end_code = 0
        rospy.core.add_preshutdown_hook(self._note_reason)
        rospy.on_shutdown(self._end)

    def run(self, *loops: Callable[[], None]) -> int:
        """Run each loop in a thread until the node ends; return the exit code for the process.

        Ctrl-C sets `stop`; the loops then have two seconds to stop the robot and return, while ROS still works. The
        node also ends when one of them returns.
        """
        self._threads = [
            threading.Thread(target=self._run_loop, args=(loop,), name=loop.__name__, daemon=True) for loop in loops
        ]
        for thread in self._threads:
            thread.start()
        self._spin()
        return 1 if self._failed.is_set() else self._end_code

    def cycles(self, period: float, patience: float | None = None) -> Iterator[float]:
        """Yield the time [s, monotonic] every `period` seconds until the node ends. A late cycle is not made up for.

        A cycle that is late by more than `patience` seconds (default: the node's) makes the node count as frozen.
        """
        within = period + (self.patience if patience is None else patience)
        due = time.monotonic()
        while not self.stop.wait(max(0.0, due - time.monotonic())):
            heartbeat.beat(within)
            now = time.monotonic()
            yield now
            due = max(due + period, now)

    def shut_down(self, reason: str) -> None:
        """End the node."""
        rospy.signal_shutdown(reason)

    def fail(self, reason: str) -> None:
        """End the node as failed, so that it is started again."""
        rospy.logfatal("%s", reason)
        self._failed.set()
        self.shut_down(reason)

    def at_end(self, close: Callable[[], None]) -> None:
        """Have `close` called when the loops have ended, the newest such call first."""
        self._closers.insert(0, close)

    def _spin(self) -> None:
        """What rospy.spin does, and a sign of life: the loops give theirs themselves."""
        try:
            while not rospy.is_shutdown():
                heartbeat.beat(_SPIN_PERIOD + heartbeat.WITHIN)
                time.sleep(_SPIN_PERIOD)
        except KeyboardInterrupt:
            self.shut_down("keyboard interrupt")

    def _run_loop(self, loop: Callable[[], None]) -> None:
        try:
            loop()
        except rospy.ROSException:
            if not self.stop.is_set():  # else a topic or a wait was closed by the shutdown itself
                self._fail()
        except Exception:  # whatever it is, the node must end with a traceback and an exit code
            self._fail()
        heartbeat.rest()
        if not self.stop.is_set():
            self.shut_down("a loop of the node ended")

    def _fail(self) -> None:
        rospy.logfatal("the node fails", exc_info=True)
        self._failed.set()

    def _note_reason(self, reason: str) -> None:
        self._end_code = end_code(reason)

    def _end(self) -> None:
        """Called by rospy when the node is to end, before it closes the topics."""
        heartbeat.beat(ENDING_TIMEOUT)
        self.stop.set()
        deadline = time.monotonic() + self.shutdown_timeout
        for thread in self._threads:
            if threading.current_thread() is not thread:
                thread.join(max(0.0, deadline - time.monotonic()))
        for close in self._closers:
            close()


def stop_on_signals(stop: threading.Event) -> threading.Event:
    """Let Ctrl-C, SIGTERM and a closed terminal set `stop` and do nothing else; return `stop`.

    For nodes that read keys: rospy's own handlers know no closed terminal and leave no time for a last zero.
    """
    stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    return stop


def hide_late_publications() -> None:
    """Hide, in nodes with actions, that actionlib publishes from a timer that outlives the topics by a moment.

    rospy closes topics before it says that it is shut down, so what counts is that a shutdown was asked for.
    """
    report = threading.excepthook

    def hook(arguments: threading.ExceptHookArgs) -> None:
        if not (rospy.core.is_shutdown_requested() and isinstance(arguments.exc_value, rospy.ROSException)):
            report(arguments)

    threading.excepthook = hook
