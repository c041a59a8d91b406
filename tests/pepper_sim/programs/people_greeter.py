"""Says hello once to everybody whose face appears."""

import argparse
import sys
import time

import qi


class HumanGreeter:
    """Listens to FaceDetected and greets."""

    def __init__(self, app, seconds):
        app.start()
        session = app.session
        self.seconds = seconds
        self.memory = session.service("ALMemory")
        self.subscriber = self.memory.subscriber("FaceDetected")
        self.subscriber.signal.connect(self.on_human_tracked)
        self.tts = session.service("ALTextToSpeech")
        self.face_detection = session.service("ALFaceDetection")
        self.face_detection.subscribe("HumanGreeter")
        self.got_face = False
        self.greeted = False

    def on_human_tracked(self, value):
        if value == []:
            self.got_face = False
            print("nobody")
        elif not self.got_face:
            self.got_face = True
            time_stamp = value[0]
            faces = value[1]
            for face in faces[:-1]:
                shape, extra = face
                print(f"face at alpha {shape[1]:.2f} beta {shape[2]:.2f}, seen at {time_stamp[0]}")
                print("nose at {:.2f} {:.2f}".format(*extra[7]))
            self.tts.say("Hello!")
            self.greeted = True

    def run(self):
        print("Starting HumanGreeter")
        deadline = time.time() + self.seconds
        while not self.greeted and time.time() < deadline:
            time.sleep(0.1)
        self.face_detection.unsubscribe("HumanGreeter")
        print("greeted" if self.greeted else "nobody came")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", type=str, default="tcp://127.0.0.1:9559")
    parser.add_argument("--seconds", type=float, default=20.0)
    args, _ = parser.parse_known_args()
    try:
        application = qi.Application(["HumanGreeter", "--qi-url=" + args.qi_url])
    except RuntimeError:
        print("Can't connect to Naoqi at " + args.qi_url)
        sys.exit(1)
    HumanGreeter(application, args.seconds).run()
