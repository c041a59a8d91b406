"""A pilot beside the drive server of another machine's Pepper: holds 0.2 m/s from the line "hold" until another one."""

from __future__ import annotations

import sys
import threading

from telepresence.drive.link import DriveLink

held, ended = threading.Event(), threading.Event()


def listen() -> None:
    for line in sys.stdin:
        (held.set if line == "hold\n" else held.clear)()
    ended.set()


threading.Thread(target=listen, daemon=True).start()
link = DriveLink(sys.argv[1])
while not ended.wait(0.05):
    if held.is_set():
        link.drive(0.2, 0.0, 0.0)
    else:
        link.release()
link.close()
