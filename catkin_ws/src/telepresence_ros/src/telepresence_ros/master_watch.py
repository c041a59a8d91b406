"""Outlives the ROS master: notices that it is gone, and registers this node again with the one that comes back.

rospy registers a node once. When roscore is restarted the node's connections go on, but the new master knows nobody:
no topic, no service, no name. `MasterWatch` asks the master again and again whether it still knows the node, over the
documented Master API (http://wiki.ros.org/ROS/Master_API), and repeats the registrations if it does not.

A connection that is closed or refused is certain at once: nobody listens there any more. A master that is only silent
may be slow, on a busy machine for longer than an answer may take, and gets a second chance. `./stack up` kills a master
that froze (`telepresence.station.master_keeper`), which makes it certain, too.
"""

from __future__ import annotations

import http.client
import logging
import sys
import threading
import time
import xmlrpc.client
from collections.abc import Callable
from typing import Any

import rosgraph
import rospy
from rospy.impl.registration import get_service_manager, get_topic_manager

from telepresence.station.ros_master import MasterConnection, master_answers, master_proxy

log = logging.getLogger(__name__)

PERIOD = 0.2
"""Seconds between two questions to the master by a node that drives a robot: a master that froze must stop the robot
within half a second."""
IDLE_PERIOD = 1.0
"""Seconds between two questions by any other node: twenty of them ask."""
RETRY_PERIOD = 0.1
"""Seconds until the next question to a master that has not answered."""
START_TIMEOUT = 10.0
"""Seconds that a node waits for a master at its start."""
START_ANSWER = 2.0
"""Seconds that an answer may take then: a small computer that starts twenty nodes at once is slow."""
PATIENCE = 0.5
"""Seconds after which it says what it waits for."""


def wait_for_master(timeout: float = START_TIMEOUT, stop: threading.Event | None = None) -> None:
    """Wait for the ROS master; `rospy.init_node` alone would wait for ever without a word.

    Args:
        timeout: [s]; infinity is allowed.
        stop: Ends the waiting, too.

    Raises:
        SystemExit: It does not answer in time, or `stop` was set.
    """
    uri = rosgraph.get_master_uri()
    advice = f"No ROS master answers at {uri}. Start one with:  roscore\nor set ROS_MASTER_URI to where one runs."
    stop = stop or threading.Event()
    began, reported = time.monotonic(), False
    while not master_answers(uri, START_ANSWER):
        waited = time.monotonic() - began
        if waited > timeout:
            sys.exit(f"No ROS master answered at {uri} within {timeout:g} s.")
        if waited > PATIENCE and not reported:
            reported = True
            print(advice, file=sys.stderr, flush=True)
        if stop.wait(0.1):
            sys.exit(0)


class MasterWatch:
    """Watches the master from a thread of its own. Make one after `rospy.init_node`.

    Args:
        on_lost: Called once when the master has ended, or has not answered for `patience` seconds: stop the robot.
        on_found: Called once when it answers again and this node is registered with it.
        patience: Seconds of silence that count as a lost master.
    """

    def __init__(
        self,
        on_lost: Callable[[], None] | None = None,
        on_found: Callable[[], None] | None = None,
        patience: float = 0.4,
    ) -> None:
        self._period = IDLE_PERIOD if on_lost is None else PERIOD
        self._on_lost = on_lost or (lambda: None)
        self._on_found = on_found or (lambda: None)
        self._misses_allowed = max(1, round(patience / PERIOD))
        self._misses = 0
        self._thread = threading.Thread(target=self._run, name="master-watch", daemon=True)
        self._uri = rosgraph.get_master_uri()
        self._name = rospy.get_name()
        self._run_id: str | None = None

    @property
    def alive(self) -> bool:
        """Whether the master answered lately."""
        return self._misses < self._misses_allowed

    def start(self) -> MasterWatch:
        """Begin to watch; return self."""
        self._thread.start()
        return self

    def _run(self) -> None:
        connection = MasterConnection(self._uri)
        pause = self._period
        while not rospy.is_shutdown():
            ended = connection.wait_for_end(pause)
            pause = self._period
            try:
                known, _, uri = connection.master.lookupNode(self._name, self._name)
                doubtful = known != 1 or ended or self._misses > 0
                run_id = self._ask_run_id(connection.master) if doubtful or self._run_id is None else self._run_id
            except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
                was_lost = not self.alive
                self._misses += 1
                if isinstance(error, ConnectionRefusedError):
                    self._misses = max(self._misses, self._misses_allowed)
                pause = RETRY_PERIOD
                if not self.alive and not was_lost:
                    log.warning("the ROS master at %s does not answer any more", self._uri)
                    self._call(self._on_lost)
                continue
            if rospy.is_shutdown():
                return  # the master has forgotten this node because it ends
            if known == 1 and uri != rospy.get_node_uri():
                continue  # another node has taken the name; the master asks rospy to end this one
            # A new master may know the name already, by the one topic that this node has advertised meanwhile.
            new = known != 1 or (doubtful and (not run_id or run_id != self._run_id))
            if new and not self._register():
                continue
            self._run_id = run_id
            was_lost = not self.alive
            self._misses = 0
            if was_lost:
                log.warning("the ROS master at %s answers again", self._uri)
                self._call(self._on_found)

    def _ask_run_id(self, master: Any) -> str:
        """Return what tells one run of the master from another; empty for a master that roscore has not started.

        On a machine that is busy for a moment all nodes miss an answer. Would all register again, every update would go
        to every node, and the machine be busier still.
        """
        code, _, run_id = master.getParam(self._name, "/run_id")
        return run_id if code == 1 else ""

    def _register(self) -> bool:
        """Repeat what rospy registered with the old master: publishers, subscribers, services. False if it failed."""
        node_uri = rospy.get_node_uri()
        master = master_proxy(self._uri, timeout=2.0)
        topics = get_topic_manager()
        log.info("registering %s with a new master", self._name)
        try:
            for publisher in list(topics.pubs.values()):
                master.registerPublisher(self._name, publisher.resolved_name, publisher.type, node_uri)
            for name, service in list(get_service_manager().map.items()):
                master.registerService(self._name, name, service.uri, node_uri)
            for subscriber in list(topics.subs.values()):
                answer: Any = master.registerSubscriber(self._name, subscriber.resolved_name, subscriber.type, node_uri)
                code, _, publishers = answer
                if code == 1:
                    # The node's own slave API takes the list of publishers, as it would from the master.
                    xmlrpc.client.ServerProxy(node_uri).publisherUpdate("/master", subscriber.resolved_name, publishers)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
            log.warning("registering %s again failed, next try in %.1f s: %s", self._name, PERIOD, error)
            return False
        return True

    def _call(self, callback: Callable[[], None]) -> None:
        try:
            callback()
        except Exception:  # a callback of the node; its failure must not end the watch
            log.exception("a callback of the master watch failed")
