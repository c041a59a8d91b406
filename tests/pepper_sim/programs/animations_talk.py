"""Talks with its hands, raises an event on the way, and wakes the lights of its eyes with a call inside the text."""

import sys

import qi


class Talker:
    def __init__(self, app):
        app.start()
        session = app.session
        self.speech = session.service("ALAnimatedSpeech")
        self.movement = session.service("ALSpeakingMovement")
        self.memory = session.service("ALMemory")
        self.met = []
        self.subscriber = self.memory.subscriber("Talker/Met")
        self.subscriber.signal.connect(self.met.append)

    def run(self):
        self.movement.setMode("contextual")
        self.movement.addTagsToWords({"hello": ["aloha"]})
        self.speech.say(
            "^pCall(ALLeds.fadeRGB('FaceLeds', 'green', 0.1)) Aloha, I am Pepper!", {"bodyLanguageMode": "contextual"}
        )
        self.speech.say(
            "^start(animations/Stand/Gestures/Me_1) This is me. $Talker/Met=you ^wait(animations/Stand/Gestures/Me_1)"
        )
        self.movement.resetTagsToWords()
        print("met " + ", ".join(self.met))


if __name__ == "__main__":
    app = qi.Application(sys.argv)
    Talker(app).run()
