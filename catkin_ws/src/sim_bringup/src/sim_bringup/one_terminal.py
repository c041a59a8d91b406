"""`python3 sim.py --terrain flat`: the walker on ROS in one terminal, as the simulation guide starts it.

Runs the node `robot_control_node` (see `sim_bringup.node`) in this process, and a ROS master when none answers, because
ROS 2, which the guide used, needs none. MuJoCo's viewer opens where there is a display. Ctrl-C ends all of it.
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import os
import sys
import xmlrpc.client
from collections.abc import Iterator, Sequence
from typing import Any

import rospy

from sim_bringup import node
from telepresence import ports
from telepresence.sim.scene import scene_names
from telepresence.station import processes
from telepresence.station.master_keeper import MasterKeeper
from telepresence.station.ros_master import master_answers, master_proxy
from telepresence.station.start_conditions import require_master_here
from telepresence.station.virtual_display import display_answers

NAME = "robot_control_node"
OTHERS = "Pepper and Robotino need their drivers too:  ./stack up pepper terrain:=flat"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulation until Ctrl-C; return the exit status."""
    options = parse(sys.argv[1:] if arguments is None else arguments)
    uri = os.environ.setdefault("ROS_MASTER_URI", "http://localhost:11311")
    processes.adopt_orphans()
    try:
        if options.viewer is None:
            options.viewer = has_display()
            if not options.viewer:
                print("No display here, so MuJoCo's viewer stays closed; the simulation runs without it.", flush=True)
        with ros_master(uri):
            require_alone(uri)
            rospy.set_param(rospy.resolve_name(NAME), parameters(options))
            # Not rospy's own arguments but ours stand on the command line.
            sys.argv[1:] = []
            return node.run(NAME, node.read_robots, options.terrain)
    except (RuntimeError, OSError) as error:
        print(f"sim.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 0
    finally:
        processes.end_descendants()


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options; `viewer` is None where nothing is said about it.

    Raises:
        SystemExit: With a usage line.
    """
    parser = argparse.ArgumentParser(
        prog="python3 sim.py",
        description="The simulated walker on ROS: robot_camera, body_state, movement_command, restart_simulation.",
        epilog=OTHERS,
    )
    parser.add_argument(
        *("--terrain", "--scene"),
        choices=scene_names(),
        default="flat",
        help="the place and its ground (default: %(default)s)",
    )
    parser.add_argument(
        "--viewer",
        action=argparse.BooleanOptionalAction,
        help="MuJoCo's viewer (default: where there is a display)",
    )
    parser.add_argument("--gait", choices=("trot", "crawl"), default="trot", help="(default: %(default)s)")
    parser.add_argument(
        "--port",
        type=int,
        default=ports.WALKER,
        help="port of the walker's web server; 0 takes a free one (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, default=0, help="start of all random sequences (default: %(default)s)")
    return parser.parse_args(arguments)


def parameters(options: argparse.Namespace) -> dict[str, Any]:
    """Return the node's parameters, see `sim_bringup.node`."""
    return {
        "robots": f"walker:walker:{options.port}",
        "kinds": {"walker": {"gait": options.gait}},
        "scene": options.terrain,
        "seed": options.seed,
        "viewer": options.viewer,
    }


def has_display() -> bool:
    """Return whether a window can be opened: MuJoCo ends the whole process where it cannot."""
    return bool(os.environ.get("WAYLAND_DISPLAY")) or display_answers(os.environ.get("DISPLAY"))


@contextlib.contextmanager
def ros_master(uri: str) -> Iterator[None]:
    """Use the ROS master at `uri` (http://host:port), or run one there meanwhile.

    Raises:
        RuntimeError: There is none, and none can be started; or that is no address of one.
    """
    require_master_here(uri)
    if master_answers(uri, timeout=1.0):
        print(f"Using the ROS master that runs at {uri}", flush=True)
        yield
        return
    keeper = MasterKeeper(uri)
    try:
        yield
    finally:
        keeper.close()


def require_alone(uri: str) -> None:
    """Raise RuntimeError when a simulation runs on this ROS master already: a second node of this name would end it."""
    name = rospy.resolve_name(NAME)
    try:
        found, _, node_uri = master_proxy(uri, timeout=1.0).lookupNode("/sim", name)
        alive = found == 1 and master_proxy(node_uri, timeout=1.0).getPid("/sim")[0] == 1
    except (OSError, http.client.HTTPException, xmlrpc.client.Error):
        alive = False  # a dead simulation may stay on the master's list
    if alive:
        raise RuntimeError(f"a simulation runs already: {name}. End it first, or set another ROS_MASTER_URI")
