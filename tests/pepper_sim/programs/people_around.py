"""Prints who is around: where, how far, how tall, in which zone, sitting or standing, and the colour of the shirt."""

import argparse
import sys
import time

import qi

SERVICES = ("ALPeoplePerception", "ALEngagementZones", "ALSittingPeopleDetection", "ALFaceCharacteristics")


def main(session):
    memory = session.service("ALMemory")
    extractors = [session.service(name) for name in SERVICES]
    for extractor in extractors:
        extractor.subscribe("people_around")
    time.sleep(1.5)
    people = memory.getData("PeoplePerception/PeopleList")
    print(len(people), "people")
    for person in people:
        key = "PeoplePerception/Person/" + str(person) + "/"
        x, y, z = memory.getData(key + "PositionInRobotFrame")
        sitting = memory.getData(key + "IsSitting") == 1
        words = [
            f"x={x:.1f} y={y:.1f} z={z:.1f}",
            "zone=" + str(memory.getData(key + "EngagementZone")),
            "sits" if sitting else "stands",
            memory.getData(key + "ShirtColor"),
        ]
        age = memory.getListData([key + "AgeProperties"])[0]
        if age:
            words.append(f"about {age[0]:.0f} years")
        print(", ".join(words))
    for extractor in extractors:
        extractor.unsubscribe("people_around")


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
