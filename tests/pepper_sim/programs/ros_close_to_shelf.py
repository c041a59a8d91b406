"""Drives straight ahead up to a shelf, without the protection against obstacles if the owner allows that."""

import argparse

import qi


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ip", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--distance", type=float, default=0.4, help="metres")
    arguments = parser.parse_args()
    session = qi.Session()
    session.connect(f"tcp://{arguments.ip}:{arguments.port}")
    motion = session.service("ALMotion")
    motion.wakeUp()
    try:
        motion.setExternalCollisionProtectionEnabled("Move", False)
    except RuntimeError as error:
        print("protected:", error)
    print("protection:", motion.getExternalCollisionProtectionEnabled("Move"))
    try:
        arrived = motion.moveTo(arguments.distance, 0.0, 0.0)
        print("arrived:", arrived)
    finally:
        motion.stopMove()
        motion.setExternalCollisionProtectionEnabled("All", True)


main()
