"""Waits for one of a few words, with word spotting, and obeys."""

import argparse
import time

import qi

WORDS = {"look left": 0.6, "look right": -0.6}


def main(session, seconds):
    memory = session.service("ALMemory")
    motion = session.service("ALMotion")
    recognition = session.service("ALSpeechRecognition")
    recognition.setLanguage("English")
    recognition.pause(True)
    recognition.setVocabulary(list(WORDS), True)
    recognition.pause(False)
    memory.insertData("WordRecognized", ["", -3.0])
    recognition.subscribe("speech_vocabulary")
    print("listening")
    try:
        end = time.time() + seconds
        while time.time() < end:
            phrase, confidence = memory.getData("WordRecognized")[:2]
            phrase = phrase.replace("<...>", "").strip()
            if phrase in WORDS and confidence > 0.4:
                print("understood:", phrase)
                motion.setStiffnesses("Head", 1.0)
                motion.angleInterpolationWithSpeed("HeadYaw", WORDS[phrase], 0.3)
                return
            time.sleep(0.1)
        print("nothing understood")
    finally:
        recognition.unsubscribe("speech_vocabulary")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--seconds", type=float, default=30.0)
    args = parser.parse_args()
    session = qi.Session()
    session.connect("tcp://" + args.ip + ":" + str(args.port))
    main(session, args.seconds)
