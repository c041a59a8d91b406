#!/usr/bin/env python
# Runs on the robot's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP010, UP031
"""Stops a NAOqi robot whose ROS driver fell silent. Runs on NAOqi's side, where a dead network cannot reach it.

Wire: while it drives, the driver writes the ALMemory key `Telepresence/Driver/Heartbeat` twenty times a second, another
number each time; it writes 0 when it lets go. Here the key is read every 50 ms. When it is not 0 and has not changed
for 0.6 s, `ALMotion.stopMove()` is called, and `ALMotion.killMove()` if the robot still moves 0.2 s later; then the key
is set to 0, so that other programs can drive the robot. Only changes count, by this machine's own monotonic clock: the
clocks of robot and driver need not agree.

Use, on the robot:          python watchdog.py
Use, with a simulator:      python watchdog.py --qi-url tcp://127.0.0.1:9559
To have it always, copy it to the robot and name it below [python] in ~/naoqi/preferences/autoload.ini, the file of
programs that NAOqi 2.5 starts with itself.
"""

from __future__ import print_function

import argparse
import os
import signal
import sys
import threading
import time

KEY = "Telepresence/Driver/Heartbeat"
PERIOD = 0.05
PATIENCE = 0.6
BRAKING_TIME = 0.2
CALL_TIMEOUT = 0.5
CONNECT_TIMEOUT = 3.0
FIRST_PAUSE, LONGEST_PAUSE = 0.25, 4.0
REPORT_AFTER = 2.0


def monotonic():
    """Seconds by a clock that nobody can set; Python 2.7 has none, but Linux does."""
    if hasattr(time, "monotonic"):
        return time.monotonic()
    with open("/proc/uptime") as clock:
        return float(clock.read().split()[0])


# libqi's own messages repeat what is reported here.
os.environ.setdefault("QI_LOG_LEVEL", "1")


class Heartbeat(object):
    """Judges a heartbeat. No clock and no robot in here: the time is an argument."""

    def __init__(self, patience=PATIENCE):
        self._patience = patience
        self._beat = None
        self._changed = 0.0

    def has_stopped(self, beat, now):
        """Whether `beat`, read at `now` [s], belongs to a driver that holds the robot and fell silent."""
        if beat != self._beat:
            self._beat = beat
            self._changed = now
        return bool(beat) and now - self._changed > self._patience


class Robot(object):
    """The few calls to NAOqi that are needed, each with an end."""

    def __init__(self, url):
        import qi

        self._session = qi.Session()
        wait(self._session.connect(url, _async=True), CONNECT_TIMEOUT)
        self._memory = wait(self._session.service("ALMemory", _async=True), CONNECT_TIMEOUT)
        self._motion = wait(self._session.service("ALMotion", _async=True), CONNECT_TIMEOUT)

    def read_heartbeat(self):
        """The heartbeat; None when there never was one."""
        return wait(self._memory.getListData([KEY], _async=True), CALL_TIMEOUT)[0]

    def stop(self):
        """Stop the base, first gently, then at once."""
        stopping = self._motion.stopMove(_async=True)
        if not is_done_within(stopping, BRAKING_TIME):
            wait(self._motion.killMove(_async=True), CALL_TIMEOUT)
        wait(self._memory.insertData(KEY, 0, _async=True), CALL_TIMEOUT)

    def close(self):
        self._session.close()


def wait(future, timeout):
    """The value of a qi future. Raises RuntimeError with the robot's text, or after `timeout` [s]."""
    return future.value(int(timeout * 1000))


def is_done_within(future, timeout):
    deadline = monotonic() + timeout
    while future.isRunning() and monotonic() < deadline:
        time.sleep(0.01)
    return not future.isRunning()


def watch(robot, heart, stopped):
    """Watch one robot until `stopped` is set. Raises RuntimeError when the robot does not answer."""
    while not stopped.wait(PERIOD):
        if heart.has_stopped(robot.read_heartbeat(), monotonic()):
            say("the driver is silent for %.1f s: stopping the robot" % PATIENCE)
            robot.stop()


def run(url, stopped):
    """Watch the robot at `url`, connecting again whenever the link breaks, until `stopped` is set."""
    heart = Heartbeat()  # it outlives a broken link: silence goes on counting
    told, pause, failing_since = None, FIRST_PAUSE, monotonic()
    while not stopped.is_set():
        robot = None
        try:
            robot = Robot(url)
            say("watching the driver of the robot at %s" % url)
            told, pause = None, FIRST_PAUSE
            watch(robot, heart, stopped)
        except RuntimeError as error:
            cause = (str(error).strip().splitlines() or ["unknown"])[0]
            if robot is not None:
                failing_since = monotonic()
            if cause != told and monotonic() - failing_since >= REPORT_AFTER:
                say("no link to the robot at %s: %s; trying again until it answers" % (url, cause))
                told = cause
            stopped.wait(pause)
            pause = min(2 * pause, LONGEST_PAUSE)
        finally:
            if robot is not None:
                robot.close()


def say(text):
    print("watchdog: " + text, file=sys.stderr)
    sys.stderr.flush()


def main(argv):
    parser = argparse.ArgumentParser(description="Stop a NAOqi robot whose ROS driver fell silent.")
    parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559", help="where NAOqi answers (default: %(default)s)")
    # roslaunch adds name:=value words; they are not for us.
    arguments = parser.parse_args([word for word in argv if ":=" not in word])
    stopped = threading.Event()
    requests = []
    for number in (signal.SIGINT, signal.SIGTERM):
        # Nothing with a lock: this may interrupt the same thread while it holds that lock.
        signal.signal(number, lambda *_: requests.append(True))
    watcher = threading.Thread(target=run, args=(arguments.qi_url, stopped), name="watchdog")
    watcher.daemon = True
    watcher.start()
    # Python 2.7 delivers signals only between short waits of the main thread.
    while watcher.is_alive():
        watcher.join(0.2)
        if requests:
            stopped.set()
    return 0 if stopped.is_set() else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
