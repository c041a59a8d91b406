"""Lets the robot turn to people by itself for a while, and prints whom it tracks."""

import argparse
import sys
import time

import qi


class Awareness:
    """Counts HumanTracked and HumanLost."""

    def __init__(self, application, seconds):
        application.start()
        session = application.session
        self.seconds = seconds
        self.awareness = session.service("ALBasicAwareness")
        memory = session.service("ALMemory")
        self.tracked = memory.subscriber("ALBasicAwareness/HumanTracked")
        self.tracked.signal.connect(self.on_tracked)
        self.lost = memory.subscriber("ALBasicAwareness/HumanLost")
        self.lost.signal.connect(self.on_lost)

    def on_tracked(self, number):
        print("nobody" if number == -1 else f"tracking {number}")

    def on_lost(self, *_):
        print("lost")

    def run(self):
        self.awareness.setEngagementMode("FullyEngaged")
        self.awareness.setTrackingMode("BodyRotation")
        self.awareness.setStimulusDetectionEnabled("Sound", False)
        self.awareness.setEnabled(True)
        time.sleep(self.seconds)
        self.awareness.setEnabled(False)
        self.awareness.setStimulusDetectionEnabled("Sound", True)
        self.awareness.setTrackingMode("Head")
        self.awareness.setEngagementMode("Unengaged")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559")
    parser.add_argument("--seconds", type=float, default=3.0)
    args, _ = parser.parse_known_args()
    try:
        app = qi.Application(["Awareness", "--qi-url=" + args.qi_url])
    except RuntimeError as error:
        sys.exit(str(error))
    Awareness(app, args.seconds).run()
