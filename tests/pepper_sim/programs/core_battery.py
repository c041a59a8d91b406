"""Prints the charge of the battery, and says when it is low."""

import argparse
import sys

import qi


def main(session, low):
    battery = session.service("ALBattery")
    charge = battery.getBatteryCharge()
    print(f"battery: {charge} %")
    if charge < low:
        session.service("ALTextToSpeech").say("I am tired.")
        print("said so")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1", help="Robot IP address")
    parser.add_argument("--port", type=int, default=9559, help="NAOqi port number")
    parser.add_argument("--low", type=int, default=20)
    arguments = parser.parse_args()
    session = qi.Session()
    try:
        session.connect(f"tcp://{arguments.ip}:{arguments.port}")
    except RuntimeError:
        print(f"Can't connect to Naoqi at {arguments.ip}:{arguments.port}", file=sys.stderr)
        sys.exit(1)
    main(session, arguments.low)
