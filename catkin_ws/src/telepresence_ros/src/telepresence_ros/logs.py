"""Shows what modules without ROS log as if rospy had logged it."""

from __future__ import annotations

import importlib.metadata
import logging
import os
import sys
from pathlib import Path

import rospkg
import rospy
from rosgraph import roslogging
from rospy.impl.paramserver import get_param_server_cache

from telepresence.security import private_files
from telepresence.security.outside_text import keep_logs_plain


def our_packages() -> set[str]:
    """Return the names of the Python packages that log for us: those of the distribution telepresence, and those of the
    catkin workspace that this package was found in."""
    import telepresence_ros

    names = set()
    try:
        top_level = importlib.metadata.distribution("telepresence").read_text("top_level.txt") or ""
        names |= set(top_level.split())
    except importlib.metadata.PackageNotFoundError:
        names.add("telepresence")  # run from the source tree
    # In catkin's devel and install spaces all packages of the workspace lie side by side.
    workspace = Path(str(telepresence_ros.__file__)).parents[1]
    return names | {init.parent.name for init in workspace.glob("*/__init__.py")}


LOST_CONNECTION = ("ROSHandshakeException", "OSError", "ConnectionError", "ConnectionResetError", "BrokenPipeError",
                   "ConnectionRefusedError", "RemoteDisconnected", "TransportTerminated", "TransportInitError",
                   "TimeoutError")  # fmt: skip
"""Errors by which rospy notices that the node at the other end of a connection has ended."""
ABOUT_OTHERS = ("rospy.internal", "rospy.rosout", "rospy.registration")
"""rospy's loggers that write the traceback of a lost connection down; the last when a node ends with its master."""
CLOSED_MEANWHILE = "AttributeError: 'NoneType' object has no attribute 'buff_size'"
"""What rospy (tcpros_base.py) makes of a connection that is closed by one of its threads while another one opens it."""


def shorten_lost_connection(record: logging.LogRecord) -> bool:
    """Leave of rospy's traceback about a node or master that has ended one line: programs are restarted, which is no
    error here.

    A filter for the loggers of `ABOUT_OTHERS`; every record passes.
    """
    text = record.getMessage()
    before, sign, trace = text.partition("Traceback (most recent call last)")
    error = trace.strip().rpartition("\n")[2]
    name = error.partition(":")[0].rpartition(".")[2]
    if sign and before.startswith("Unable to report rosout: "):  # which says the reason itself
        record.msg, record.args = before.strip(), ()
    elif sign and (name in LOST_CONNECTION or error.startswith(CLOSED_MEANWHILE)):
        record.msg, record.args = f"{before.strip()} {error}", ()
    return True


NOTHING_CAME = "terminated before handshake header received. 0 bytes were received"
"""What rospy says about another node that takes back a subscription while it is being made."""


def calm_half_connection(record: logging.LogRecord) -> bool:
    """Make rospy's warning about a connection that was given up before it began an ordinary line: there is nothing to
    do about it, and while a station starts it happens all the time.

    A filter for the logger "rosout"; every record passes.
    """
    if record.levelno == logging.WARNING and NOTHING_CAME in record.getMessage():
        record.levelno, record.levelname = logging.INFO, logging.getLevelName(logging.INFO)
    return True


def renew_latest_link(run: str) -> bool:
    """What rosgraph.roslogging has under the name renew_latest_logdir, in one step: that one removes the link and then
    makes it, and says so when another node has made it meanwhile. Raises OSError.

    Args:
        run: The folder with the logs of this run.
    Returns:
        False when something else has the link's name.
    """
    latest = Path(run).parent / "latest"
    if latest.exists() and not latest.is_symlink():
        return False
    if not latest.is_symlink() or os.readlink(latest) != run:
        new = latest.with_name(f".latest-{os.getpid()}")
        new.unlink(missing_ok=True)
        new.symlink_to(run)
        new.rename(latest)
    return True


def close_log_folder() -> None:
    """Close the folder of ROS logs, in which stands what was said, to other users; let nodes that start at the same
    time agree on its link `latest`, and not warn of each other. Call it before `rospy.init_node`."""
    roslogging.renew_latest_logdir = renew_latest_link
    logging.getLogger("rosout").addFilter(calm_half_connection)
    try:
        private_files.make_folder(Path(rospkg.get_log_dir()))
    except OSError as error:
        print(f"telepresence: other users may read what is logged: {error}", file=sys.stderr)


OF_EACH_LINE = "/rosout_disable_topics_generation"
"""The parameter that rospy reads for each line that it logs (rospy/impl/rosout.py)."""


def log_without_master() -> None:
    """Let a line be logged without a question to the ROS master. Call it after `rospy.init_node`.

    rospy does not remember that nobody has set OF_EACH_LINE, and asks anew for each line, with no time limit: a master
    that hangs, or is out of reach, holds whoever logs, were it the loop that drives a robot. Besides, each question
    subscribes to the parameter, by which a node that has ended stays on the master's list. A value that is set later
    counts for nodes that start later.
    """
    get_param_server_cache().set(OF_EACH_LINE, rospy.get_param(OF_EACH_LINE, False))


def route_logs_to_ros() -> None:
    """Show the logs of our packages on the terminal and on /rosout. Call it after `rospy.init_node`.

    All lines that this process logs are plain text from then on, whatever a robot or a message brought.
    """
    keep_logs_plain()
    for name in ABOUT_OTHERS:
        logging.getLogger(name).addFilter(shorten_lost_connection)
    for name in our_packages():
        logger = logging.getLogger(name)
        logger.setLevel(logging.INFO)
        logger.propagate = False
        logger.handlers = list(logging.getLogger("rosout").handlers)
