"""Looks for a free place to dance and drives to its middle."""

import argparse
import math

import qi


def main(session, radius, displacement):
    navigation = session.service("ALNavigation")
    motion = session.service("ALMotion")
    motion.wakeUp()
    session.service("ALRobotPosture").goToPosture("StandInit", 0.5)
    navigation.startFreeZoneUpdate()
    motion.moveTo(0.0, 0.0, 2.2)
    code, found, centre = navigation.stopAndComputeFreeZone(radius, displacement)
    if code == 1:
        print("Problem during the update of the free zone.")
        return
    print(f"code {code} radius {found:.2f}")
    x, y, theta = motion.getRobotPosition(True)
    dx, dy = centre[0] - x, centre[1] - y
    motion.moveTo(math.cos(theta) * dx + math.sin(theta) * dy, -math.sin(theta) * dx + math.cos(theta) * dy, 0.0)
    print("here I dance")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--radius", type=float, default=0.6)
    parser.add_argument("--displacement", type=float, default=0.5)
    args = parser.parse_args()
    session = qi.Session()
    session.connect(f"tcp://{args.ip}:{args.port}")
    main(session, args.radius, args.displacement)
