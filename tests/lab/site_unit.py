"""A site's unit that is no station: it beats, and its page has a socket."""

PREPARES = """
import os, socket, sys, time
from pathlib import Path
from telepresence.station import heartbeat
"""
RUNS = """
server = socket.socket(socket.AF_UNIX)
server.bind(sys.argv[1])
server.listen()
heartbeat.notify("READY=1")
while True:
    heartbeat.beat()
    time.sleep(0.05)
"""
UNIT = PREPARES + RUNS
"""A program whose only argument is the socket's path."""
