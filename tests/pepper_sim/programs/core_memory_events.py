"""A module in the old style: it counts an event, and tells others by an event of its own."""

import argparse
import threading

import qi


class Counter:
    """Counts touches."""

    def __init__(self, session, wanted):
        self.memory, self.wanted = session.service("ALMemory"), wanted
        self.count, self.done = 0, threading.Event()

    def onTouched(self, event, value, subscriber):
        """Called by ALMemory."""
        if value == 1.0:
            self.count += 1
            self.memory.raiseEvent("Counter/Touches", self.count)
            if self.count >= self.wanted:
                self.done.set()


parser = argparse.ArgumentParser()
parser.add_argument("--ip", default="127.0.0.1")
parser.add_argument("--port", type=int, default=9559)
parser.add_argument("--count", type=int, default=2)
arguments = parser.parse_args()
session = qi.Session()
session.connect(f"tcp://{arguments.ip}:{arguments.port}")
counter = Counter(session, arguments.count)
number = session.registerService("Counter", counter)
counter.memory.subscribeToEvent("MiddleTactilTouched", "Counter", "onTouched")
print("subscribers:", counter.memory.getSubscribers("MiddleTactilTouched"), flush=True)
counter.done.wait()
counter.memory.unsubscribeToEvent("MiddleTactilTouched", "Counter")
session.unregisterService(number)
print("touched", counter.count, "times")
