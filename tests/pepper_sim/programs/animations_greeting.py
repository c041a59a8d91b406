#! /usr/bin/env python
# -*- encoding: UTF-8 -*-

"""Waves, points and bows: animations by path, by the robot's posture and by tag."""

import argparse
import sys

import qi


def main(session):
    player = session.service("ALAnimationPlayer")

    # play an animation to its end
    player.run("animations/[posture]/Gestures/Hey_1")

    # play another one in the background, and wait for it
    future = player.run("animations/Stand/Gestures/ShowSky_1", _async=True)
    future.value()

    # my own tag
    player.addTagForAnimations({"myGreeting": ["animations/Stand/Gestures/BowShort_1"]})
    player.runTag("myGreeting")
    player.reset()
    print("greeted")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1", help="Robot IP address.")
    parser.add_argument("--port", type=int, default=9559, help="Naoqi port number")
    args = parser.parse_args()
    session = qi.Session()
    try:
        session.connect("tcp://" + args.ip + ":" + str(args.port))
    except RuntimeError:
        print("Can't connect to Naoqi at ip \"" + args.ip + '" on port ' + str(args.port) + ".")
        sys.exit(1)
    main(session)
