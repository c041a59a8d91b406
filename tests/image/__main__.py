"""Whether the image is what docs/container.md promises; `./stack image` has built it. Minutes, and not in `.ci/run`:

    ./stack exec python tests/image [simulated] [pepper] [robotino] [--image NAME] [--arch arm64]

A container of it runs as a stranger's would: published ports, a read-only root file system, no capabilities, a volume
that is new. Chromium, outside, opens the printed link, sees and drives; then parts are killed, and the healthcheck must
notice; then it is asked to end. `pepper` and `robotino` stand for real ones, see real_robots.py. Of another processor's
image only that it works is asked, not how fast. CONTAINER_TOOL names another engine than podman, CONTAINER_RUN_OPTIONS
further options of its `run`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import shlex
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "lab"))

from container import Container, Failed, engine, reached, say, wait_for, wrong  # noqa: E402
from newcomer import Newcomer  # noqa: E402
from real_robots import check_pepper, check_robotino  # noqa: E402
from stranger import come_in, looked_at  # noqa: E402

MOST_BYTES = 900_000_000
FIRST_PICTURE_WITHIN = 20.0
"""[s] from `run`, on two cores."""
ENDS_WITHIN = 10.0
"""[s]"""
NOTICES_WITHIN = 20.0
"""[s] from a part's death until the healthcheck is red."""
NATIVE = {"x86_64": "amd64", "aarch64": "arm64"}.get(os.uname().machine, "")
EMULATION = 1200.0
"""[s] of patience for a processor that is emulated."""
LIGHT = ROOT / "tests" / "image" / "emulated.launch"
"""What is started where one processor emulates another, which takes ten times as long."""
ASK_PEPPER = """
import telepresence.naoqi as qi
session = qi.Session()
session.connect("tcp://127.0.0.1:9559")
print(len(session.services()))
"""
TOOLS_OF_BUILDERS = "gcc g++ cc c++ cpp make cmake ld as pip pip3 pytest ruff mypy chromium Xvnc git"
PARTS = {
    "the robot": "pepper_bringup/pepper_sim",
    "its driver": "__name:=naoqi_driver",
    "the ROS master": "telepresence_ros.core",
    "the page": "__name:=pilot_page",
}
"""What the healthcheck must miss -> what stands in the command line of its program."""


def check_image(image: str, arch: str) -> None:
    """Look at the image without running the station."""
    (facts,) = json.loads(engine("image", "inspect", image).stdout)
    config = facts["Config"]
    size = facts["Size"]
    say("size, unpacked", arch != "amd64" or size <= MOST_BYTES, f"{size / 1e6:.0f} MB, at most {MOST_BYTES / 1e6:.0f}")
    say("user", config.get("User") not in ("", "root", "0"), config.get("User", ""))
    say("SIGTERM ends it", config.get("StopSignal") in ("SIGTERM", "15"), str(config.get("StopSignal")))
    say("one volume", len(config.get("Volumes") or {}) == 1, " ".join(config.get("Volumes") or {}))
    say("healthcheck", bool(facts.get("Healthcheck") or config.get("Healthcheck")))
    options = shlex.split(os.environ.get("CONTAINER_RUN_OPTIONS", ""))
    looks = (
        f"for tool in {TOOLS_OF_BUILDERS}; do command -v $tool; done; "
        "find / -xdev '(' -name cc1plus -o -name stdio.h ')'; "
        "find / -xdev -perm -o+w -type f -not -path '/proc/*' 2>/dev/null; ls -d /opt/telepresence/tests"
    )
    found = engine(
        "run", "--rm", "--pull", "never", "--platform", f"linux/{arch}", *options,
        "--entrypoint", "bash", image, "-c", looks, timeout=EMULATION,
    )  # fmt: skip
    say("neither compiler nor tests nor files that everybody may write", not found.stdout.strip(), found.stdout.strip())


def position(container: Container) -> tuple[float, float]:
    """Where the simulated robot is [m]."""
    text = container.ros("rostopic", "echo", "-n1", "/truth/pose/pose/position")
    found = [re.search(rf"{axis}: (\S+)", text) for axis in "xy"]
    if None in found:
        raise Failed(f"no /truth: {text}")
    return tuple(float(each[1]) for each in found if each)  # type: ignore[return-value]


def check_station(container: Container, newcomer: Newcomer) -> None:
    """Open the page as a stranger, see and drive."""
    took = come_in(container, newcomer)
    say("first picture after run", took <= FIRST_PICTURE_WITHIN, f"{took:.1f} s")
    wait_for(newcomer.is_there, 120.0)
    wait_for(container.healthy, 60.0)
    say("healthcheck is green, way of the pictures", True, newcomer.way())
    begin = position(container)
    newcomer.hold_forward()
    wait_for(lambda: _distance(begin, position(container)) > 0.1, 60.0)
    newcomer.let_go()
    say("holding W in the page drives the robot", True)
    say("the window, which asks who one is, runs, too", "/gui_ros_node" in container.ros("rosnode", "list"))


def _distance(one: tuple[float, float], other: tuple[float, float]) -> float:
    return ((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2) ** 0.5


def check_container(container: Container) -> None:
    """Look into the running container."""
    who = container.run("id", "-u").stdout.strip()
    say("runs as", who not in ("", "0"), who)
    tried = container.run("sh", "-c", "touch /opt/telepresence/x /x /etc/x; touch /var/lib/telepresence/x && echo kept")
    say("only the volume can be written", tried.stdout == "kept\n" and tried.stderr.count("Read-only") == 3)
    root = container.run("sh", "-c", "stat -c %u /proc/[0-9]* | sort -u").stdout.split()
    say("all programs are this user's", root == [who], " ".join(root))


def check_health(container: Container) -> None:
    """Stop each part, which starts again: killed ones are back before anybody sees them missing."""
    for name, part in PARTS.items():
        wait_for(container.healthy, 60.0)
        begin = time.monotonic()
        stopped = threading.Event()

        def keep_away(part: str = part, stopped: threading.Event = stopped) -> None:
            while not stopped.is_set():  # whoever starts it again has it killed again
                with contextlib.suppress(Failed):  # it is not back yet
                    container.kill(part, "SIGKILL")
                stopped.wait(0.2)

        killer = threading.Thread(target=keep_away)
        killer.start()
        try:
            wait_for(lambda: not container.healthy(), NOTICES_WITHIN)
        finally:
            stopped.set()
            killer.join()
        say(
            f"healthcheck is red without {name}", True, f"after {time.monotonic() - begin:.1f} s; {container.complaint}"
        )
    wait_for(container.healthy, 120.0)
    say("healthcheck is green again", True)


def check_end(container: Container, newcomer: Newcomer) -> None:
    """SIGTERM while the robot drives."""
    wait_for(newcomer.is_there, 60.0)
    begin = position(container)
    newcomer.hold_forward()
    wait_for(lambda: _distance(begin, position(container)) > 0.05, 60.0)
    asked = time.monotonic()
    engine("kill", "--signal", "TERM", container.name)
    wait_for(lambda: container.code is not None, ENDS_WITHIN)
    say("SIGTERM ends all of it", container.code == 0, f"{time.monotonic() - asked:.1f} s, exit code {container.code}")


def check_simulated(image: str, arch: str) -> None:
    """Everything about a container with the simulated Pepper. Raises Failed."""
    check_image(image, arch)
    container = Container(image, arch, "up", "pepper")
    with looked_at(container) as newcomer:
        check_station(container, newcomer)
        check_container(container)
        check_health(container)
        check_end(container, newcomer)


def check_emulated(image: str, arch: str) -> None:
    """An image for another processor: the simulated Pepper answers, and the page shows what it sees. Raises Failed."""
    check_image(image, arch)
    start = f"roslaunch /{LIGHT.name} page:=$(hostname -i)"
    container = Container(image, arch, "exec", "bash", "-c", start, options=["--volume", f"{LIGHT}:/{LIGHT.name}:ro"])
    with looked_at(container) as newcomer:
        say("machine", True, container.run("uname", "-m").stdout.strip())
        wait_for(lambda: reached(container.port), EMULATION)
        invited = container.run("/opt/telepresence/stack", "invite", "--drive", timeout=EMULATION).stdout
        link = re.search(r"https://\S+", invited)
        if link is None:
            raise Failed(f"no link: {invited}")
        took = come_in(container, newcomer, EMULATION, link[0])
        say("first picture after run", True, f"{took:.0f} s")
        answer = container.run("/opt/telepresence/stack", "exec", "python", "-c", ASK_PEPPER, timeout=EMULATION).stdout
        say("the simulated Pepper answers on NAOqi", answer.strip().isdigit(), f"{answer.strip()} services")
        asked = time.monotonic()
        engine("kill", "--signal", "TERM", container.name)
        wait_for(lambda: container.code is not None, EMULATION)
        say("SIGTERM ends all of it", True, f"{time.monotonic() - asked:.1f} s, exit code {container.code}")


SCENARIOS = {"simulated": check_simulated, "pepper": check_pepper, "robotino": check_robotino}


def main() -> int:
    parser = argparse.ArgumentParser(prog="./stack exec python tests/image", description=__doc__.partition("\n")[0])
    parser.add_argument("scenarios", nargs="*", metavar="scenario", help=f"some of {', '.join(SCENARIOS)}; default all")
    parser.add_argument("--image", default="telepresence")
    parser.add_argument(
        "--arch", default=NATIVE, choices=("amd64", "arm64"), help="another than this machine's: emulated, one scenario"
    )
    arguments = parser.parse_args()
    if unknown := set(arguments.scenarios) - set(SCENARIOS):
        parser.error(f"there is no scenario {min(unknown)!r}: {', '.join(SCENARIOS)}")
    wanted = {name: SCENARIOS[name] for name in arguments.scenarios or SCENARIOS}
    if arguments.arch != NATIVE:
        wanted = {"emulated": check_emulated}
    for name, check in wanted.items():
        print(f"{name}:", flush=True)
        try:
            check(arguments.image, arguments.arch)
        except Failed as failed:
            first, _, rest = str(failed).partition("\n")
            say(first, False)
            print(rest, file=sys.stderr)
    print("\nThe image is as it should be." if not wrong else "\nNot as it should be: " + "; ".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
