"""What a person has set in a node outlives its death, and not its end."""

import os
import signal
import subprocess
import sys
import textwrap

import pytest

from telepresence.station import processes
from telepresence.station.ros_master import RESTARTED, master_proxy

pytestmark = pytest.mark.ros

NODE = textwrap.dedent("""
    import sys
    from telepresence_ros.kept_state import KeptState
    from telepresence_ros.node import Node

    node = Node("sound")
    kept = KeptState()
    kept.keep(lambda: {"muted": True})
    print(kept.switch("muted", False, quiet=True), flush=True)

    def loop():
        sys.stdin.readline() or node.stop.wait()
        raise RuntimeError("a part is broken")

    sys.exit(kept.forget_after(node.run(loop if sys.argv[1] == "fails" else node.stop.wait)))
""")


def shut_down(uri, reason):
    """What the master's API has for ending a node."""
    master_proxy(master_proxy(uri).lookupNode("/tests", "/sound")[2]).shutdown("/tests", reason)


@pytest.mark.parametrize(
    ("end", "code", "remembered"),
    [
        ("fails", 1, True),
        ("is killed", -signal.SIGKILL, True),
        ("is not known to a new master", os.EX_TEMPFAIL, True),
        ("is told to end", 0, False),
        ("is interrupted", 0, False),
    ],
)
def test_it_is_remembered_unless_the_node_has_ended_in_order(ros_master, run_program, end, code, remembered):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    node = run_program(sys.executable, "-c", NODE, end, **pipes)
    assert node.stdout.readline() == "False\n"
    match end:
        case "fails":
            node.stdin.write("\n")
            node.stdin.flush()
        case "is killed":
            node.kill()
        case "is not known to a new master":
            shut_down(ros_master["ROS_MASTER_URI"], RESTARTED)
        case "is told to end":
            shut_down(ros_master["ROS_MASTER_URI"], "user request")
        case "is interrupted":
            processes.send(node.pid, signal.SIGINT)
    assert node.wait(20) == code
    again = run_program(sys.executable, "-c", NODE, "again", **pipes)
    assert again.stdout.readline() == f"{remembered}\n"
