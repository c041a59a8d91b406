"""Drives around a square and says how far from its start the robot ends."""

import argparse
import math

import qi


def drive(motion, side):
    start = motion.getRobotPosition(False)
    for corner in range(4):
        config = [["MaxVelXY", 0.5], ["MaxAccXY", 0.5], ["MaxVelTheta", 2.0], ["MaxAccTheta", 3.0]]
        if not motion.moveTo(side, 0.0, math.pi / 2, config):
            print("stopped on side", corner + 1)
            return False
    end = motion.getRobotPosition(False)
    print(f"error: {math.hypot(end[0] - start[0], end[1] - start[1]):.2f} m")
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ip", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--side", type=float, default=0.5)
    arguments = parser.parse_args()
    session = qi.Session()
    session.connect(f"tcp://{arguments.ip}:{arguments.port}")
    motion = session.service("ALMotion")
    motion.wakeUp()
    motion.moveInit()
    motion.setExternalCollisionProtectionEnabled("Arms", False)
    try:
        drive(motion, arguments.side)
    finally:
        motion.stopMove()
        motion.setExternalCollisionProtectionEnabled("Arms", True)


main()
