"""`telepresence_ros.probe` as a node of its own, which a test commands over its standard input.

One process holds one rospy node and one master for life, so tests do not load rospy themselves. Requests and answers
are lines of JSON; see `Probe` in conftest.py. It says when messages came, so it waits for no ordinary program.
"""

from __future__ import annotations

import json
import sys

import rospy
from telepresence_ros.probe import Probe
from telepresence_ros.single_connections import connect_once

from telepresence.station import priority


def main() -> None:
    priority.put_commands_first()
    connect_once()
    rospy.init_node("probe", anonymous=True, disable_signals=True)
    probe = Probe()
    for line in sys.stdin:
        name, arguments = json.loads(line)
        print(json.dumps(getattr(probe, name)(*arguments)), flush=True)


if __name__ == "__main__":
    main()
