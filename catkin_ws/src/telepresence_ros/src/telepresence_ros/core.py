"""What `roscore` does, for `./stack up`: the ROS master, its first parameters, and the node `rosout`.

    python -m telepresence_ros.core -p PORT

The master is Debian's rosmaster. It listens on loopback, and on the address that this machine announces (ROS_IP,
ROS_HOSTNAME), nowhere else; `roscore` would listen on all addresses as soon as one of the two is not loopback, and its
`rosout`, a roscpp program, always.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import uuid
from pathlib import Path

import rosgraph.network
import rosgraph.roslogging
import rosmaster.master_api
import rospkg
from rosgraph.xmlrpc import ThreadingXMLRPCServer

from telepresence.station import processes
from telepresence.stop_signals import stop_on
from telepresence_ros.sockets import bind_address, narrow_sockets

CALLER = "/roscore"
LOOPBACK = "127.0.0.1"
ROSOUT_PERIOD = 1.0
"""Seconds after which a `rosout` that has ended is started again."""


def main() -> int:
    """Run until SIGINT or SIGTERM; the exit code."""
    parser = argparse.ArgumentParser(prog="telepresence_ros.core", description="The ROS master of ./stack up.")
    parser.add_argument("-p", "--port", type=int, default=11311)
    port = parser.parse_args().port
    stop = threading.Event()
    stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    narrow_sockets()
    run_id = str(uuid.uuid1())
    folder = Path(rospkg.get_log_dir(env=os.environ)) / run_id
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    rosgraph.roslogging.configure_logging("rosmaster", filename=str(folder / "master.log"))

    handler = rosmaster.master_api.ROSMasterHandler()
    handler._ready(f"http://{rosgraph.network.get_host_name()}:{port}/")
    for name, value in first_parameters(run_id).items():
        handler.setParam(CALLER, name, value)
    try:
        servers = [serve(handler, address, port) for address in addresses()]
    except OSError as error:
        print(f"telepresence_ros.core: port {port}: {error.strerror}", file=sys.stderr)
        return 1
    try:
        keep_rosout(folder, stop)
    finally:
        handler._shutdown("the core ends")
        for server in servers:
            server.shutdown()
            server.server_close()
    return 0


def addresses() -> list[str]:
    """Where the master listens: programs of this machine find it at localhost, others at what it announces."""
    announced = bind_address()
    return [announced] if announced in ("0.0.0.0", "::", "::1", LOOPBACK) else [LOOPBACK, announced]


def serve(handler: rosmaster.master_api.ROSMasterHandler, address: str, port: int) -> ThreadingXMLRPCServer:
    """Answer the Master API at an address, from a thread. Raises OSError."""
    server = ThreadingXMLRPCServer((address, port), log_requests=0)
    server.register_multicall_functions()
    server.register_instance(handler)
    threading.Thread(target=server.serve_forever, name=f"master at {address}", daemon=True).start()
    return server


def first_parameters(run_id: str) -> dict[str, str]:
    """What roscore sets; roslaunch waits for the first."""
    return {
        "/run_id": run_id,
        "/rosversion": f"{rospkg.RosPack().get_manifest('roslaunch').version}\n",
        "/rosdistro": f"{os.environ.get('ROS_DISTRO', 'debian').lower()}\n",
    }


def keep_rosout(folder: Path, stop: threading.Event) -> None:
    """Run the node `rosout`, again whenever somebody ends it, until `stop` is set."""
    command = [sys.executable, "-m", "telepresence_ros.rosout", f"__log:={folder / 'rosout-1.log'}"]
    while not stop.is_set():
        rosout = processes.start(command, tied=True)
        while not stop.wait(ROSOUT_PERIOD):
            if rosout.poll() is not None:
                break
        processes.end(rosout)


if __name__ == "__main__":
    sys.exit(main())
