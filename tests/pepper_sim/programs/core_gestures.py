"""Says the name of the first gesture that somebody makes on the robot's head, and ends."""

import sys
import threading

import qi


class ReactToGesture:
    def __init__(self, app):
        app.start()
        self.tts = app.session.service("ALTextToSpeech")
        self.gestures = app.session.service("ALTactileGesture")
        self.seen = threading.Event()
        self.name = None
        self.link = self.gestures.onGesture.connect(self.on_gesture)

    def on_gesture(self, name):
        if self.name is None:
            self.name = name
            self.seen.set()

    def run(self):
        print("Touch my head.", flush=True)
        self.seen.wait()
        self.gestures.onGesture.disconnect(self.link)
        self.tts.say(self.name)
        print(self.name)


if __name__ == "__main__":
    try:
        app = qi.Application(["ReactToGesture", *sys.argv[1:]])
    except RuntimeError as error:
        sys.exit(f"no robot: {error}")
    ReactToGesture(app).run()
