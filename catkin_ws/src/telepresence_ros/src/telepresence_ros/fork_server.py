"""Starts nodes that are Python programs by fork(2) of a process that has imported what most of them need.

Twenty interpreters that each import rospy cost 0.4 s of processor time and 20 MB of memory apiece; a fork costs 20 ms
and shares the memory of what is never written. A node started this way is a process like any other: it has arguments,
environment, session, output and end of its own, and the name of its program in `ps`.

`ForkServer` is its client's side, in roslaunch. Both ends speak over a socket: a JSON object and the descriptors of
standard output, standard error and, where it gets one of its own, standard input start a program and are answered with
its process id; its end comes later. The first answer says that the server has imported everything and serves.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import selectors
import signal
import socket
import sys
import types
from collections.abc import Sequence
from dataclasses import dataclass

import setproctitle

from telepresence.station.priority import exempt_from_collection

PRELOADED = (
    "rospy", "numpy", "cv2", "tf2_ros", "sensor_msgs.msg", "geometry_msgs.msg", "nav_msgs.msg", "diagnostic_msgs.msg",
    "telepresence_msgs.msg", "telepresence_msgs.srv", "std_srvs.srv", "naoqi_bridge_msgs.msg", "telepresence_ros.node",
    "telepresence_ros.diagnostics", "telepresence.naoqi.references", "telepresence.video.images",
    "telepresence.start_patience", "telepresence.geometry", "telepresence.teleop.accounts", "telepresence.page.qr_code",
    "aiohttp", "argparse", "configparser", "encodings.idna", "naoqi_driver.naoqi_node",
)  # fmt: skip
"""What is imported before. Nothing here may start a thread: fork copies only the one that calls it."""
LOOK_AT_ENVIRONMENT = ("rospy.names", "telepresence.station.heartbeat")
"""Modules that look at arguments and environment when they are imported."""
STREAMS = (1, 2, 0)
"""What the descriptors become that come with a program."""
LONGEST = 128 * 1024
"""Bytes of a message: arguments and environment of a program."""


@dataclass(frozen=True)
class Program:
    """What to become.

    Args:
        words: Script and arguments.
        folder: To work in.
    """

    words: list[str]
    environment: dict[str, str]
    folder: str

    def run(self) -> None:
        """Become it: `python SCRIPT ARGUMENT ...` in a process that was just forked."""
        os.setsid()
        os.chdir(self.folder)
        os.environ.clear()
        os.environ.update(self.environment)
        sys.argv = list(self.words)
        sys.path[0] = os.path.dirname(os.path.realpath(self.words[0]))
        setproctitle.setproctitle(" ".join([sys.executable, *self.words]))
        for name in LOOK_AT_ENVIRONMENT:
            importlib.reload(sys.modules[name])
        script = self.words[0]
        main = types.ModuleType("__main__")
        main.__file__ = script
        sys.modules["__main__"] = main
        with open(script, "rb") as file:
            code = compile(file.read(), script, "exec")
        exec(code, main.__dict__)  # what python itself does with a script


def serve(channel: socket.socket) -> Program | None:
    """Start what is asked for until the client closes its end; returns in every forked process what to become, and None
    at the end of the server itself."""
    reader, writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.set_wakeup_fd(writer)
    signal.signal(signal.SIGCHLD, lambda _signal, _frame: None)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    selector = selectors.DefaultSelector()
    selector.register(channel, selectors.EVENT_READ)
    selector.register(reader, selectors.EVENT_READ)
    _send(channel, {"serves": os.getpid()})
    while True:
        for key, _ in selector.select():
            if key.fd == reader:
                os.read(reader, 512)
                _report_ends(channel)
                continue
            try:
                text, descriptors, _, _ = socket.recv_fds(channel, LONGEST, len(STREAMS))
            except ConnectionResetError:  # the client was killed, and had not read an answer
                return None
            if not text:
                return None
            program = Program(**json.loads(text))
            process = os.fork()
            if process == 0:
                _leave_server(descriptors, (channel.detach(), reader, writer), selector)
                return program
            for descriptor in descriptors:
                os.close(descriptor)
            _send(channel, {"started": process})


def _leave_server(descriptors: Sequence[int], ours: Sequence[int], selector: selectors.BaseSelector) -> None:
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGCHLD, signal.SIGINT):
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    selector.close()
    for descriptor in ours:
        os.close(descriptor)
    for target, descriptor in zip(STREAMS, descriptors, strict=False):
        os.dup2(descriptor, target)
    for descriptor in descriptors:
        os.close(descriptor)
    gc.enable()


def _report_ends(channel: socket.socket) -> None:
    with contextlib.suppress(ChildProcessError):
        while (ended := os.waitpid(-1, os.WNOHANG))[0]:
            _send(channel, {"ended": ended[0], "code": os.waitstatus_to_exitcode(ended[1])})


def _send(channel: socket.socket, fields: dict[str, int]) -> None:
    with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # the client has gone: nobody asks any more
        channel.send(json.dumps(fields).encode())


def main() -> None:
    """Run the server at the socket whose descriptor is the first argument; the second one makes room for names."""
    channel = socket.socket(fileno=int(sys.argv[1]))
    setproctitle.setproctitle(f"{sys.executable} -m telepresence_ros.fork_server")
    for name in PRELOADED:
        importlib.import_module(name)
    exempt_from_collection()  # what a collection would look through, it would write to: no longer shared
    gc.disable()
    program = serve(channel)
    if program is not None:
        program.run()


if __name__ == "__main__":
    main()
