"""Looks for landmarks for some seconds, and says where each of them is, seen from the robot."""

import argparse
import math
import sys
import time

import qi


class LandmarkDetector:
    def __init__(self, session, size):
        self.size = size
        self.found = {}
        self.memory = session.service("ALMemory")
        self.subscriber = self.memory.subscriber("LandmarkDetected")
        self.link = self.subscriber.signal.connect(self.on_landmark_detected)
        self.landmark_detection = session.service("ALLandMarkDetection")
        self.landmark_detection.subscribe("LandmarkDetector", 200, 0.0)

    def on_landmark_detected(self, marks):
        if not marks:
            return
        for shape, extra in marks[1]:
            alpha, beta, width = shape[1:4]
            distance = self.size / (2 * math.tan(width / 2))
            x, y, z, _, pitch, yaw = marks[3]
            self.found[extra[0]] = (
                x + distance * math.cos(yaw + alpha) * math.cos(pitch + beta),
                y + distance * math.sin(yaw + alpha) * math.cos(pitch + beta),
                z - distance * math.sin(pitch + beta),
            )

    def run(self, seconds, wanted):
        end = time.time() + seconds
        while time.time() < end and len(self.found) < wanted:
            time.sleep(0.05)
        self.subscriber.signal.disconnect(self.link)
        self.landmark_detection.unsubscribe("LandmarkDetector")
        for number in sorted(self.found):
            x, y, z = self.found[number]
            print(f"mark {number} at {x:.3f} {y:.3f} {z:.3f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1", help="Robot IP address")
    parser.add_argument("--port", type=int, default=9559, help="NAOqi port number")
    parser.add_argument("--size", type=float, default=0.16, help="diameter of the marks in metres")
    parser.add_argument("--wanted", type=int, default=2)
    args = parser.parse_args()
    try:
        app = qi.Application(["LandmarkDetector", f"--qi-url=tcp://{args.ip}:{args.port}"])
        app.start()
    except RuntimeError:
        print(f"Can't connect to Naoqi at {args.ip}:{args.port}")
        sys.exit(1)
    LandmarkDetector(app.session, args.size).run(20.0, args.wanted)
