"""Talks about drinks: loads a topic, lets the human answer, and prints what was chosen."""

import argparse
import sys
import time

import qi

TOPIC = """topic: ~drinks()
language: enu
concept:(drink) [water juice "green tea"]
u:(e:Drinks/Start) %ask What would you like to drink?
    u1:(_~drink {please}) Here is your $1. $Drinks/Choice=$1
    u1:(nothing) Then nothing. $Drinks/Choice=nothing
u:(hello) ^rand["hello" "hi there"] human
"""


class DrinkSeller:
    def __init__(self, app):
        app.start()
        session = app.session
        self.memory = session.service("ALMemory")
        self.dialog = session.service("ALDialog")
        self.choice = ""
        self.subscriber = self.memory.subscriber("Drinks/Choice")
        self.subscriber.signal.connect(self.on_choice)

    def on_choice(self, value):
        self.choice = value

    def run(self, seconds):
        self.dialog.setLanguage("English")
        name = self.dialog.loadTopicContent(TOPIC)
        self.dialog.activateTopic(name)
        self.dialog.subscribe("drink_seller")
        try:
            print("topics:", self.dialog.getActivatedTopics())
            self.memory.raiseEvent("Drinks/Start", 1)
            end = time.time() + seconds
            while not self.choice and time.time() < end:
                time.sleep(0.1)
            print("choice:", self.choice)
        finally:
            self.dialog.unsubscribe("drink_seller")
            self.dialog.deactivateTopic(name)
            self.dialog.unloadTopic(name)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--seconds", type=float, default=30.0)
    args = parser.parse_args()
    try:
        application = qi.Application(["DrinkSeller", f"--qi-url=tcp://{args.ip}:{args.port}"])
    except RuntimeError:
        print(f"Can't connect to Naoqi at {args.ip}:{args.port}")
        sys.exit(1)
    DrinkSeller(application).run(args.seconds)
