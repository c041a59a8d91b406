"""What `roscore` does, for `./stack up`: the ROS master, its first parameters, and the node `rosout`.

    python -m telepresence_ros.core -p PORT [--watch FOLDER]

The master is Debian's rosmaster; what we add to it: `telepresence_ros.master_handler`. It listens on loopback and on
the address that this machine announces (ROS_IP, ROS_HOSTNAME), nowhere else; `roscore` would listen on all addresses as
soon as one of the two is not loopback, and its `rosout`, a roscpp program, always.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import time
import uuid
from functools import partial
from pathlib import Path

import rosgraph.network
import rosgraph.roslogging
import rospkg
from rosgraph.xmlrpc import ThreadingXMLRPCServer

from telepresence.station import heartbeat, processes, station_folder, vitals
from telepresence.station.absence import Absence, goes_on
from telepresence.station.faults import SOCKET, FaultReporter
from telepresence.station.kept_program import KeptProgram
from telepresence.station.vitals import Beats
from telepresence.stop_signals import stop_on
from telepresence_ros.master_handler import MasterHandler
from telepresence_ros.sockets import bind_address, narrow_sockets

CALLER = "/roscore"
LOOPBACK = "127.0.0.1"
SERVE_PERIOD = 0.1
"""Seconds after which the master's loops say at the latest that they work."""
ENDING_TIMEOUT = 15.0
"""Seconds in which `rosout` has ended."""


def main() -> int:
    """Run until SIGINT or SIGTERM; the exit code."""
    parser = argparse.ArgumentParser(prog="telepresence_ros.core", description="The ROS master of ./stack up.")
    parser.add_argument("-p", "--port", type=int, default=11311)
    parser.add_argument("--watch", type=Path, help="folder of the station's watch: where faults are reported")
    arguments = parser.parse_args()
    port = arguments.port
    stop = threading.Event()
    stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    narrow_sockets()
    run_id = str(uuid.uuid1())
    folder = Path(rospkg.get_log_dir(env=os.environ)) / run_id
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    rosgraph.roslogging.configure_logging("rosmaster", filename=str(folder / "master.log"))

    host = rosgraph.network.get_host_name()
    handler = MasterHandler({LOOPBACK, "localhost", host})
    handler._ready(f"http://{host}:{port}/")
    for name, value in first_parameters(run_id).items():
        handler.setParam(CALLER, name, value)
    try:
        servers = [serve(handler, address, port) for address in addresses()]
    except OSError as error:
        print(f"telepresence_ros.core: port {port}: {error.strerror}", file=sys.stderr)
        return 1
    try:
        keep_rosout(folder, stop, arguments.watch)
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


def serve(handler: MasterHandler, address: str, port: int) -> ThreadingXMLRPCServer:
    """Answer the Master API at an address, from a thread. Raises OSError."""
    server = _BeatingServer((address, port), log_requests=0)
    server.register_multicall_functions()
    server.register_instance(handler)
    threading.Thread(
        target=server.serve_forever, args=(SERVE_PERIOD,), name=f"master at {address}", daemon=True
    ).start()
    return server


class _BeatingServer(ThreadingXMLRPCServer):
    def service_actions(self) -> None:
        """Called by the loop that accepts connections, whenever it has accepted one and every SERVE_PERIOD."""
        heartbeat.beat()


def first_parameters(run_id: str) -> dict[str, str]:
    """What roscore sets; roslaunch waits for the first."""
    return {
        "/run_id": run_id,
        "/rosversion": f"{rospkg.RosPack().get_manifest('roslaunch').version}\n",
        "/rosdistro": f"{os.environ.get('ROS_DISTRO', 'debian').lower()}\n",
    }


def keep_rosout(folder: Path, stop: threading.Event, watch: Path | None = None) -> None:
    """Run the node `rosout`, again whenever it dies or freezes or somebody ends it, until `stop` is set, or `./stack
    up` has been away for too long.

    Args:
        folder: For its log.
        watch: Where it beats and where its faults are reported; without it, only a stopped one counts as frozen.
    """
    beats = Beats(watch / "rosout") if watch is not None else None
    faults = FaultReporter(watch / SOCKET) if watch is not None else None
    environment = {**os.environ, **({"NOTIFY_SOCKET": str(beats.path)} if beats is not None else {})}
    command = [sys.executable, "-P", "-m", "telepresence_ros.rosout", f"__log:={folder / 'rosout-1.log'}"]
    rosout = KeptProgram(
        "rosout",
        partial(processes.start, command, tied=True, env=environment),
        faults.report if faults is not None else lambda *fault: None,
        beats,
    )
    absence = Absence(Path(os.environ[station_folder.VARIABLE])) if goes_on() else None
    looked = time.monotonic()
    while not stop.wait(vitals.PERIOD):
        heartbeat.beat()
        elapsed, looked = time.monotonic() - looked, time.monotonic()
        rosout.poll(elapsed)
        if absence is not None:
            absence.begins()
            if absence.too_long():
                break
        if faults is not None:
            faults.flush()
    heartbeat.beat(within=ENDING_TIMEOUT)
    rosout.close(patience=5.0)


if __name__ == "__main__":
    sys.exit(main())
