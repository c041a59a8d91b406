"""Shows a picture of its application on the tablet, and then asks for a name."""

import argparse
import sys
import time

import qi


class Greeting:
    def __init__(self, session):
        self.name = None
        self.tablet = session.service("ALTabletService")
        self.signal_id = self.tablet.onInputText.connect(self.on_input)

    def on_input(self, validation, text):
        self.name = text if validation == 1 else ""

    def run(self):
        self.tablet.showImage("http://198.18.0.1/apps/greeting/hello.png")
        time.sleep(0.5)
        self.tablet.showInputTextDialog("What is your name?", "OK", "Cancel")
        for _ in range(200):
            if self.name is not None:
                break
            time.sleep(0.05)
        self.tablet.onInputText.disconnect(self.signal_id)
        self.tablet.hideImage()
        print(f"Hello, {self.name}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", type=str, default="tcp://127.0.0.1:9559")
    args = parser.parse_args()
    session = qi.Session()
    try:
        session.connect(args.qi_url)
    except RuntimeError as error:
        sys.exit(str(error))
    Greeting(session).run()
