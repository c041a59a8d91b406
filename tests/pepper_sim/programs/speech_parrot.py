"""A fallback for the dialogue: what no rule understands is repeated, and a topic on the robot's disk says goodbye."""

import argparse

import qi


class Parrot:
    def findOutput(self, language, text):
        return "you said " + text


def main(session, topic_path):
    dialog = session.service("ALDialog")
    memory = session.service("ALMemory")
    dialog.setLanguage("English")
    identity = session.registerService("Parrot", Parrot())
    name = dialog.loadTopic(topic_path)
    dialog.activateTopic(name)
    dialog.addFallback("English", "Parrot")
    for text in ("good morning", "bye bye robot"):
        dialog.forceInput(text)
        print(text, "->", memory.getData("Dialog/Answered"))
    dialog.removeFallback("English", "Parrot")
    dialog.deactivateTopic(name)
    dialog.unloadTopic(name)
    session.unregisterService(identity)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--topic", type=str, default="/home/nao/parrot_enu.top")
    args = parser.parse_args()
    connection = qi.Session()
    connection.connect(f"tcp://{args.ip}:{args.port}")
    main(connection, args.topic)
