"""Closes and opens a gripper on relays and digital outputs of a Robotino, and says what the robot answers."""

import argparse
import json
import time
import urllib.request

PARAMS = "?sid=gripper"


def put(url, path, value):
    request = urllib.request.Request(url + path + PARAMS, json.dumps(value).encode(), method="PUT")
    with urllib.request.urlopen(request, timeout=2.0) as answer:
        return answer.status


def get(url, path):
    with urllib.request.urlopen(url + path + PARAMS, timeout=2.0) as answer:
        return json.loads(answer.read())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", default="http://192.168.0.1")
    url = parser.parse_args().url
    pins = [0] * 8
    pins[2] = int(True)
    print("outputs", put(url, "/data/digitaloutputarray", pins))
    print("close", put(url, "/data/relay", {"num": 0, "val": 1}))
    time.sleep(0.1)
    print("closed:", get(url, "/data/relaystatus"), get(url, "/data/digitaloutputstatus")[2])
    print("open", put(url, "/data/relayarray", [0, 1]))
    print("one output", put(url, "/data/digitaloutput", {"num": 2, "val": 0}))
    print("opened:", get(url, "/data/relaystatus"), any(get(url, "/data/digitaloutputstatus")))


main()
