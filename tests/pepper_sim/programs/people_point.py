"""Points at the nearest person with the nearer arm and looks there."""

import argparse
import sys
import time

import qi

FRAME_ROBOT = 2


def main(session):
    people = session.service("ALPeoplePerception")
    memory = session.service("ALMemory")
    tracker = session.service("ALTracker")
    motion = session.service("ALMotion")
    motion.wakeUp()
    people.subscribe("point")
    try:
        for _ in range(50):
            detected = memory.getListData(["PeoplePerception/PeopleDetected"])[0]
            if detected:
                break
            time.sleep(0.1)
        else:
            print("nobody is here")
            return
        number, distance = min(detected[1], key=lambda person: person[1])[:2]
        position = memory.getData(f"PeoplePerception/Person/{number}/PositionInRobotFrame")
        effector = "LArm" if position[1] > 0 else "RArm"
        print(f"person {number}, {distance:.1f} m away, with {effector}")
        tracker.lookAt(position, FRAME_ROBOT, 0.4, False)
        tracker.pointAt(effector, position, FRAME_ROBOT, 0.5)
    finally:
        people.unsubscribe("point")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    args = parser.parse_args()
    session = qi.Session()
    try:
        session.connect(f"tcp://{args.ip}:{args.port}")
    except RuntimeError as error:
        sys.exit(str(error))
    main(session)
