"""Outlives the ROS master: notices that it is gone, and registers this node again with the one that comes back.

rospy registers a node once. When roscore is restarted the node's connections go on, but the new master knows nobody:
no topic, no service, no name. `MasterWatch` asks the master every second whether it still knows the node, over the
documented Master API (http://wiki.ros.org/ROS/Master_API), and repeats the registrations if it does not.
"""

from __future__ import annotations

import http.client
import logging
import os
import sys
import threading
import time
import xmlrpc.client
from collections.abc import Callable
from typing import Any

from telepresence.station.ros_master import master_answers, master_proxy

log = logging.getLogger(__name__)

PERIOD = 0.2
"""Seconds between two questions to the master: a lost master must stop a robot within a second."""
START_TIMEOUT = 10.0
"""Seconds that a node waits for a master at its start."""


def wait_for_master(timeout: float = START_TIMEOUT) -> None:
    """Wait for the ROS master; `rospy.init_node` alone would wait for ever without a word.

    Raises:
        SystemExit: It does not answer within `timeout` seconds.
    """
    uri = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
    deadline = time.monotonic() + timeout
    while not master_answers(uri):
        if time.monotonic() > deadline:
            sys.exit(f"no ROS master answers at {uri}: start roscore, or set ROS_MASTER_URI to where one runs")
        time.sleep(0.1)


class MasterWatch:
    """Watches the master of an initialised rospy node from a thread of its own.

    Args:
        rospy: The module, after `init_node`.
        on_lost: Called once when the master has not answered for `patience` seconds: stop the robot.
        on_found: Called once when it answers again and this node is registered with it.
        patience: Seconds of silence that count as a lost master.
    """

    def __init__(
        self,
        rospy: Any,
        on_lost: Callable[[], None] | None = None,
        on_found: Callable[[], None] | None = None,
        patience: float = 0.4,
    ) -> None:
        self._rospy = rospy
        self._on_lost = on_lost or (lambda: None)
        self._on_found = on_found or (lambda: None)
        self._misses_allowed = max(1, round(patience / PERIOD))
        self._misses = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="master-watch", daemon=True)
        self._uri = _master_uri()
        self._name = rospy.get_name()

    @property
    def alive(self) -> bool:
        """Whether the master answered lately."""
        return self._misses < self._misses_allowed

    def start(self) -> MasterWatch:
        self._thread.start()
        return self

    def close(self) -> None:
        self._stop.set()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while not self._stop.wait(PERIOD):
            try:
                known, _, uri = master_proxy(self._uri).lookupNode(self._name, self._name)
            except (OSError, http.client.HTTPException, xmlrpc.client.Error):
                self._misses += 1
                if self._misses == self._misses_allowed:
                    log.warning("the ROS master at %s does not answer any more", self._uri)
                    self._call(self._on_lost)
                continue
            if known == 1 and uri != self._rospy.get_node_uri():
                continue  # another node has taken the name; the master tells rospy to end this one
            if known != 1:
                self._register()
            was_lost = not self.alive
            self._misses = 0
            if was_lost:
                log.warning("the ROS master at %s answers again", self._uri)
                self._call(self._on_found)

    def _register(self) -> None:
        """Repeat what rospy told the old master: publishers, subscribers, services."""
        from rospy.impl.registration import get_service_manager, get_topic_manager

        node_uri = self._rospy.get_node_uri()
        master = master_proxy(self._uri, timeout=2.0)
        topics = get_topic_manager()
        log.info("registering %s with a new master", self._name)
        try:
            for publisher in list(topics.pubs.values()):
                master.registerPublisher(self._name, publisher.resolved_name, publisher.type, node_uri)
            for name, service in list(get_service_manager().map.items()):
                master.registerService(self._name, name, service.uri, node_uri)
            for subscriber in list(topics.subs.values()):
                code, _, publishers = master.registerSubscriber(
                    self._name, subscriber.resolved_name, subscriber.type, node_uri
                )
                if code == 1:
                    # The node's own slave API takes the list of publishers, as it would from the master.
                    xmlrpc.client.ServerProxy(node_uri).publisherUpdate("/master", subscriber.resolved_name, publishers)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
            log.warning("registering %s again failed, next try in %.1f s: %s", self._name, PERIOD, error)

    def _call(self, callback: Callable[[], None]) -> None:
        try:
            callback()
        except Exception:
            log.exception("a callback of the master watch failed")


def _master_uri() -> str:
    import rosgraph

    return rosgraph.get_master_uri()
