"""Follows a face: with the head only, or driving to half a metre and a bit."""

import argparse
import sys
import time

import qi


def main(session, mode, distance, seconds):
    motion = session.service("ALMotion")
    tracker = session.service("ALTracker")
    motion.wakeUp()

    target = "Face"
    tracker.registerTarget(target, 0.15)
    tracker.setMode(mode)
    tracker.setRelativePosition([-distance, 0.0, 0.0, 0.1, 0.1, 0.3])
    tracker.track(target)
    print("ALTracker successfully started with", tracker.getActiveTarget())
    end = time.time() + seconds
    while time.time() < end:
        time.sleep(0.2)
    position = tracker.getTargetPosition(2)
    print("lost" if tracker.isTargetLost() else "at {:.2f} {:.2f} {:.2f}".format(*position))
    tracker.stopTracker()
    tracker.unregisterAllTargets()
    print("ALTracker stopped.")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1", help="Robot IP address.")
    parser.add_argument("--port", type=int, default=9559, help="Naoqi port number")
    parser.add_argument("--mode", default="Head")
    parser.add_argument("--distance", type=float, default=0.9)
    parser.add_argument("--seconds", type=float, default=3.0)
    args = parser.parse_args()
    session = qi.Session()
    try:
        session.connect("tcp://" + args.ip + ":" + str(args.port))
    except RuntimeError:
        print("Can't connect to Naoqi at ip " + args.ip + " on port " + str(args.port))
        sys.exit(1)
    main(session, args.mode, args.distance, args.seconds)
