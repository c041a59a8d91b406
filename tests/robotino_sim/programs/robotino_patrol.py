"""Drives forward by a distance with the localization's pose as feedback, and watches the batteries meanwhile."""

import argparse
import json
import math
import time
import urllib.request


class Robotino:
    def __init__(self, url):
        self.url = url

    def get(self, path):
        with urllib.request.urlopen(self.url + path, timeout=2.0) as answer:
            body = answer.read()
        return json.loads(body) if body.strip() else None

    def drive(self, vx, vy, omega):
        data = json.dumps([vx, vy, omega]).encode()
        urllib.request.urlopen(urllib.request.Request(self.url + "/data/omnidrive", data), timeout=2.0).close()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", default="http://192.168.0.1")
    parser.add_argument("--distance", type=float, default=0.3)
    arguments = parser.parse_args()
    robot = Robotino(arguments.url)
    with urllib.request.urlopen(arguments.url + "/", timeout=2.0) as page:
        print("web page:", page.headers["Content-Type"].split(";")[0])
    start = robot.get("/data/odometry")
    first = robot.get("/data/pose")["seq"]
    driven, end = 0.0, time.time() + 20.0
    while driven < arguments.distance and time.time() < end and not robot.get("/data/bumper")["value"]:
        robot.drive(0.3, 0.0, 0.0)
        time.sleep(0.05)
        x, y = robot.get("/data/odometry")[:2]
        driven = math.hypot(x - start[0], y - start[1])
    robot.drive(0.0, 0.0, 0.0)
    pose = robot.get("/data/pose")
    print("poses:", pose["seq"] > first, sorted(pose))
    charger = robot.get("/data/festoolcharger")
    if charger is None:
        print("no Festool charger")
    else:
        payload = charger["payload"]
        print("battery", sum(payload["capacities"]) / len(payload["capacities"]), "%", payload["chargerConnected"])
    print(f"driven {driven:.2f} m")


main()
