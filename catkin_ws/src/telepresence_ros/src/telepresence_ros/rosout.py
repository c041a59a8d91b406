"""The node `rosout`: gathers what all nodes log.

Subscribes: /rosout (rosgraph_msgs/Log).
Publishes:  /rosout_agg (rosgraph_msgs/Log): the same, from one publisher.

Writes it to rosout.log in the folder of ROS's logs, too. It replaces roscpp's program of this name, which listens on
every address of the machine whatever ROS_IP says.
"""

from __future__ import annotations

import telepresence_ros.without_numpy  # noqa: F401  before genpy

# isort: split

import logging
import logging.handlers
import os
import sys
from pathlib import Path

import rosgraph.names
import rospkg
import rospy
from rosgraph_msgs.msg import Log

from telepresence_ros.node import Node

LARGEST_FILE, OLD_FILES = 20_000_000, 4
"""Bytes of a file, and how many older ones are kept."""
LEVELS = {Log.DEBUG: "DEBUG", Log.INFO: "INFO", Log.WARN: "WARN", Log.ERROR: "ERROR", Log.FATAL: "FATAL"}


def main() -> int:
    """Run the node; the exit code."""
    node = Node("rosout")
    log = open_file()
    everybody = rospy.Publisher("/rosout_agg", Log, queue_size=1000)

    def on_log(message: Log) -> None:
        log.info("%s", line(message))
        try:
            everybody.publish(message)
        except rospy.ROSException:
            if not rospy.is_shutdown():  # at the end rospy closes topics while messages come
                raise

    rospy.Subscriber("/rosout", Log, on_log, queue_size=1000)
    return node.run()


def line(message: Log) -> str:
    """Return a message as a line of the file; line ends and other control characters of its text are escaped."""
    stamp = f"{message.header.stamp.secs}.{message.header.stamp.nsecs:09d}"
    text = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in message.msg)
    place = f"[{message.file}:{message.line}({message.function})]"
    topics = f"[topics: {', '.join(message.topics)}]"
    return f"{stamp} {LEVELS.get(message.level, message.level)} {message.name} {place} {topics} {text}"


def open_file() -> logging.Logger:
    """Return a logger for the file, beside the node's own log; its owner alone may read it."""
    own = rosgraph.names.load_mappings(sys.argv).get("__log")
    folder = Path(own).parent if own else Path(rospkg.get_log_dir(env=os.environ))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "rosout.log"
    path.touch(mode=0o600)
    handler = logging.handlers.RotatingFileHandler(path, maxBytes=LARGEST_FILE, backupCount=OLD_FILES)
    log = logging.getLogger("rosout_file")
    log.setLevel(logging.INFO)
    log.propagate = False
    log.handlers = [handler]
    return log


if __name__ == "__main__":
    sys.exit(main())
