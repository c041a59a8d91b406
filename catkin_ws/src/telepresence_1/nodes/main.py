#!/usr/bin/env python3
"""Show a page on Pepper's tablet until Ctrl-C: main.py --qi-url tcp://ROBOT:9559 [--url http://...]."""

import argparse
import logging
import signal
import sys
import threading

from naoqi_driver.connection import Address, Connection
from telepresence_1.network import NoRoute, local_address_towards
from telepresence_1.tablet_link import TabletLink


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559", help="the robot; default %(default)s")
    parser.add_argument("--url", help="the page as the tablet can reach it; default: com_cam.py's on this machine")
    arguments, _ = parser.parse_known_args()  # roslaunch adds words of its own
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    try:
        address = Address.parse(arguments.qi_url)
        url = arguments.url or f"http://{local_address_towards(arguments.qi_url)}:10002/"
    except (ValueError, NoRoute) as error:
        print(f"main.py: {error}", file=sys.stderr)
        return 1
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    with Connection(address) as connection:
        link = TabletLink(connection, url).start()
        while not stop.wait(1.0):
            pass
        link.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
