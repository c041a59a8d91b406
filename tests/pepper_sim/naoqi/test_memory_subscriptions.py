"""Who is called at events, without a robot."""

import threading
from types import SimpleNamespace

from pepper_sim.naoqi.memory_subscriptions import MemorySubscriptions


def test_a_client_that_dies_while_it_subscribes_is_not_kept():
    there = iter((True, False))
    subscriptions = MemorySubscriptions({}, threading.Lock(), SimpleNamespace(exists=lambda name: next(there)))
    subscriptions.subscribeToEvent("FaceDetected", "Dying", "onEvent")
    assert subscriptions.getSubscribers("FaceDetected") == []
