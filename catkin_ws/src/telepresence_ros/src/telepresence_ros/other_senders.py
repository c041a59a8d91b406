"""Subscriptions to what the other nodes send on a topic that this node publishes, too."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import rospy


def subscribe_to_others(
    topic: str, kind: type, callback: Callable[[Any], None], queue_size: int = 1
) -> rospy.Subscriber:
    """Subscribe to the newest messages of other nodes. Call it before this node advertises the topic.

    rospy connects a node to itself, too, and hands it its own messages on a thread of its own, which holds those for
    the others up by a third of their way.
    """
    subscriber = rospy.Subscriber(topic, kind, callback, queue_size=queue_size, tcp_nodelay=True)
    connected, own = subscriber.impl.has_connection, rospy.get_node_uri()
    # rospy asks this before it connects to a publisher.
    subscriber.impl.has_connection = lambda uri: uri == own or connected(uri)
    return subscriber
