"""Learns the face in front of the robot and greets its owner by name."""

import argparse
import sys
import time

import qi


def recognised(value):
    """The name in Time_Filtered_Reco_Info or in a FaceInfo; "" if there is none."""
    if not value or len(value) < 2:
        return ""
    for face in value[1][:-1]:
        if face[1][2]:
            return face[1][2]
    return ""


def main(session, name):
    faces = session.service("ALFaceDetection")
    memory = session.service("ALMemory")
    faces.enableTracking(True)
    if name not in faces.getLearnedFacesList() and not faces.learnFace(name):
        print("I see no face")
        return
    print("learned:", ", ".join(faces.getLearnedFacesList()))
    faces.subscribe("learn_face", 200, 0.0)
    for _ in range(50):
        found = recognised(memory.getData("FaceDetected", 0))
        if found:
            print("hello", found)
            session.service("ALTextToSpeech").say("Hello " + found)
            break
        time.sleep(0.1)
    else:
        print("who are you?")
    faces.unsubscribe("learn_face")
    faces.forgetPerson(name)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559")
    parser.add_argument("--name", default="Ada")
    args = parser.parse_args()
    session = qi.Session()
    try:
        session.connect(args.qi_url)
    except RuntimeError as error:
        sys.exit(str(error))
    main(session, args.name)
