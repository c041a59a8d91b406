"""Explores a room, saves the exploration on the robot, comes back and shows the map as text."""

import argparse
import sys

import numpy
import qi


def main(session, radius):
    navigation = session.service("ALNavigation")
    session.service("ALMotion").wakeUp()
    error = navigation.explore(radius)
    if error != 0:
        print("Exploration failed.")
        return
    path = navigation.saveExploration()
    print(f'Exploration saved at path: "{path}"')
    navigation.startLocalization()
    navigation.navigateToInMap([0.0, 0.0, 0.0])
    navigation.stopLocalization()
    result = navigation.getMetricalMap()
    width, height = result[1], result[2]
    image = numpy.array(result[4]).reshape(width, height)
    image = numpy.array((100 - image) * 2.55, numpy.uint8)
    print(f"{result[0]:.2f} m per pixel, {width} x {height}")
    print(f"free {(image < 50).sum()} occupied {(image > 200).sum()}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1", help="Robot IP address")
    parser.add_argument("--port", type=int, default=9559, help="Naoqi port number")
    parser.add_argument("--radius", type=float, default=2.0)
    args = parser.parse_args()
    session = qi.Session()
    try:
        session.connect("tcp://" + args.ip + ":" + str(args.port))
    except RuntimeError:
        print(f"Can't connect to Naoqi at ip {args.ip} on port {args.port}.")
        sys.exit(1)
    main(session, args.radius)
