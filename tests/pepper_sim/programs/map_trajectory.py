"""Drives a quarter of a circle and straight back, and counts what it hears of its progress."""

import argparse
import math
import time

import qi

parser = argparse.ArgumentParser()
parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559")
session = qi.Session()
session.connect(parser.parse_args().qi_url)
navigation = session.service("ALNavigation")
subscriber = session.service("ALMemory").subscriber("Navigation/AvoidanceNavigator/TrajectoryProgress")
heard = []
subscriber.signal.connect(heard.append)
session.service("ALMotion").wakeUp()
navigation.moveAlong(
    [
        "Composed",
        ["Holonomic", ["Circle", [0.0, 0.3], math.pi / 2], math.pi / 2, 2.0],
        ["Holonomic", ["Line", [-0.3, 0.0]], 0.0, 1.5],
    ]
)
deadline = time.time() + 5.0
while len(heard) < 2 and time.time() < deadline:
    time.sleep(0.05)
print("progress", heard)
