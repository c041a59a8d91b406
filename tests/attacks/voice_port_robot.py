"""A robot for the attacks on the port of `voice`: NAOqi's service directory, and a second program that brings sound.

python voice_port_robot.py listen URL           prints "subscribed NAME ENDPOINT …" for every subscription
python voice_port_robot.py bring URL NAME       calls the subscriber from another program, as a robot without a
                                                gateway does; prints "taken" when the call was answered
"""

from __future__ import annotations

import sys
import time

import qi

qi.logging.setLevel(qi.logging.FATAL)


def listen(url: str) -> None:
    session = qi.Session()
    session.listenStandalone(url)

    class AudioDevice:
        def setClientPreferences(self, name: str, rate: int, channels: int, deinterleaved: int) -> None:
            pass

        def subscribe(self, name: str) -> None:
            endpoints = next(each["endpoints"] for each in session.services() if each["name"] == name)
            print("subscribed", name, *endpoints, flush=True)

        def unsubscribe(self, name: str) -> None:
            pass

    session.registerService("ALAudioDevice", AudioDevice())
    print("listening", flush=True)
    while True:
        time.sleep(60)


def bring(url: str, name: str) -> None:
    session = qi.Session()
    session.connect(url)
    future = session.service(name, _async=True)
    future.value(8000).call("processRemote", 2, 480, [0, 0], bytes(1920), _async=True).value(5000)
    print("taken", flush=True)


if __name__ == "__main__":
    {"listen": listen, "bring": bring}[sys.argv[1]](*sys.argv[2:])
