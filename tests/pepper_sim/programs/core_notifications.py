"""Adds a notification for the people around the robot, and shows what is pending."""

import argparse
import sys

import qi


def main(session, message, severity):
    manager = session.service("ALNotificationManager")
    number = manager.add({"message": message, "severity": severity, "removeOnRead": True})
    print("Notification ID:", number)
    for notification in manager.notifications():
        entry = dict(notification)
        print(entry["id"], entry["severity"], entry["message"], entry["removeOnRead"])


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1", help="Robot IP address")
    parser.add_argument("--port", type=int, default=9559, help="NAOqi port number")
    parser.add_argument("--severity", choices=["info", "warning", "error"], default="info")
    parser.add_argument("message")
    arguments = parser.parse_args()
    session = qi.Session()
    try:
        session.connect(f"tcp://{arguments.ip}:{arguments.port}")
    except RuntimeError:
        print(f"Can't connect to Naoqi at {arguments.ip}:{arguments.port}", file=sys.stderr)
        sys.exit(1)
    main(session, arguments.message, arguments.severity)
