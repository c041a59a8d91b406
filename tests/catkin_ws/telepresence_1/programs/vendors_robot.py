"""A robot of the vendor's library, whose ALAudioDevice calls as a program beside the service directory does.

usage: vendors_robot.py ADDRESS
"""

import sys
import threading
import time

import qi

SAMPLES = 1365
URL = f"tcp://{sys.argv[1]}:9559"

directory, program = qi.Session(), qi.Session()
directory.listenStandalone(URL)
program.connect(URL)


@qi.multiThreaded()
class AudioDevice:
    def __init__(self):
        self._subscribed = set()

    def setClientPreferences(self, name, rate, channels, deinterleaved):
        pass

    def subscribe(self, name):
        ears = program.service(name)
        self._subscribed.add(name)
        threading.Thread(target=self._send, args=(name, ears), daemon=True).start()

    def unsubscribe(self, name):
        self._subscribed.remove(name)

    def _send(self, name, ears):
        while name in self._subscribed:
            ears.processRemote(1, SAMPLES, [0, 0], bytes(2 * SAMPLES))
            time.sleep(SAMPLES / 16000)


directory.registerService("ALAudioDevice", AudioDevice())
print("listening on", URL, flush=True)
sys.stdin.read()
