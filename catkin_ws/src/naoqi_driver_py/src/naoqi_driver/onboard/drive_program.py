# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP006, UP031
"""The command line of Pepper's drive server; see docs/pepper.md. Until SIGINT, SIGTERM or a closed terminal."""

import argparse
import os
import resource
import signal
import sys

from naoqi_driver.onboard import last_stop
from naoqi_driver.onboard.line_writer import LineWriter
from naoqi_driver.onboard.naoqi_link import NaoqiLink
from naoqi_driver.onboard.pepper_base import PepperBase
from telepresence.drive.server import DriveServer
from telepresence.robot_side.naoqi_client import place_of
from telepresence.security.shared_key import SharedKey, is_loopback

MYPY = False
if MYPY:
    from typing import Any, Callable, List, Optional, Tuple  # noqa: F401, UP035

    MakeTls = Callable[[Tuple[str, int], Callable[[str], None]], Any]

PORT = 8085
LOOPBACK = "127.0.0.1"
KEY_FILE = "robot.key"
FLUSH_TIME = 0.2
"""Seconds that a program which ends waits for its last lines to be taken."""
_RLIMIT_RTTIME, _RUNAWAY = 15, 2000000  # linux/resource.h; [us]


def main(words, make_tls=None):
    # type: (List[str], Optional[MakeTls]) -> int
    """Serve until a signal; the exit status.

    Args:
        make_tls: Returns the TLS for a NAOqi at host and port that is far (`telepresence.robot_side.naoqi_connection`);
            is given what takes a line for people. None on the robot, whose Python 2.7 has none that would do.
    """
    parser = argparse.ArgumentParser(description="Drives a Pepper for pilots, beside its NAOqi.")
    parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559", help="where NAOqi answers (default: %(default)s)")
    parser.add_argument("--address", default=LOOPBACK, help="where to listen; 0.0.0.0 for all (default: %(default)s)")
    parser.add_argument("--port", type=int, default=PORT, help="udp; 0 takes a free one (default: %(default)s)")
    parser.add_argument(
        "--key", help="the robot's key, which pilots need; wanted with any address but loopback (default: %s beside "
        "this program, if it is there)" % KEY_FILE
    )  # fmt: skip
    parser.add_argument("--far", action="store_true", help="NAOqi is behind a tunnel, although its address is near")
    parser.add_argument("--last-stop", action="store_true", help=argparse.SUPPRESS)  # how it starts its second process
    # roslaunch adds name:=value words; they are not for us.
    options = parser.parse_args([word for word in words if ":=" not in word])
    say, complain = (LineWriter(stream.fileno(), "drive_server: ") for stream in (sys.stdout, sys.stderr))
    try:
        return last_stop.watch(options.qi_url, say) if options.last_stop else serve(options, say, make_tls)
    except (EnvironmentError, ValueError) as error:  # noqa: UP024
        complain(str(error))
        return 1
    finally:
        say.flush(FLUSH_TIME)
        complain.flush(FLUSH_TIME)


def serve(options, say, make_tls=None):
    # type: (argparse.Namespace, LineWriter, Optional[MakeTls]) -> int
    key = find_key(options.key, options.address)
    come_first()
    scheme, place = place_of(options.qi_url)
    tls = make_tls(place, say) if scheme == "tcps" and make_tls is not None else None
    link = NaoqiLink(options.qi_url, say, options.far, tls)
    # Over a network every motion ends by itself.
    watcher = last_stop.LastStop(last_stop.command(options.qi_url)) if link.near else None
    try:
        base = PepperBase(link, watcher)
        server = DriveServer(base, options.address, options.port, key, say)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) != signal.SIG_IGN:  # nohup
                signal.signal(number, lambda *_: server.stop())
        say("listens on udp %s:%d" % (server.address, server.port))
        try:
            return server.run()
        except BaseException:
            base.end()
            raise
        finally:
            server.close()
    finally:
        link.close()
        if watcher is not None:
            watcher.close()


def come_first():
    # type: () -> None
    """Be served before ordinary programs on a busy machine, where that is allowed; `telepresence.station.priority` says
    who may. Whoever computes for two seconds without a pause is ended, so that it cannot freeze the machine."""
    if os.environ.get("TELEPRESENCE_PRIORITY") == "off" or not hasattr(os, "sched_setscheduler"):  # Python 2.7
        return
    try:
        resource.setrlimit(_RLIMIT_RTTIME, (_RUNAWAY, _RUNAWAY))
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    except (EnvironmentError, ValueError):  # noqa: UP024
        return


def find_key(path, address):
    # type: (Optional[str], str) -> Optional[SharedKey]
    """Return the key that pilots need; None on loopback without one: whoever is on this machine may then drive it.

    Raises:
        ValueError: There is none and the address is not loopback, or the key cannot be used; the text has the remedy.
        EnvironmentError: It cannot be read.
    """
    beside = os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), KEY_FILE)
    path = path or (beside if os.path.lexists(beside) else None)
    if path is not None:
        return SharedKey.read(path)
    if not is_loopback(address):
        raise ValueError(
            "without a key nothing listens on %s, where strangers are: name the robot's key with --key FILE "
            "(make_drive_server.py makes one, docs/pepper.md), or listen on %s" % (address, LOOPBACK)
        )
    return None
