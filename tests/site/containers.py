"""Whether a site of two containers is what docs/site.md promises; `./stack image` has built their image. Minutes:

    ./stack exec python tests/site/containers.py [--image NAME]

Two people drive the two simulated robots, each in its container; then the first container is killed, and at last the
site is asked to end. CONTAINER_RUN_OPTIONS holds further options of `podman run`.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "lab")]

from page_stranger import Pilot, Stranger  # noqa: E402
from site_in_test import Failed, RunningSite, say, wait_for, wrong  # noqa: E402

from telepresence.station import processes  # noqa: E402

ROBOTS = """
volume = "{volume}"

[robot.anna]
kind = "pepper"
image = "{image}"
settings = {{ source = "test" }}

[robot.ben]
kind = "robotino"
image = "{image}"
"""
TITLES = {"anna": "Pepper", "ben": "Robotino"}
TURN = [0.0, 0.0, 0.4]
ENDS_WITHIN = 20.0
"""[s]"""


def podman(*words: str) -> str:
    """Run podman; what it prints, or nothing when it fails."""
    answer = subprocess.run(["podman", *words], capture_output=True, text=True, timeout=60.0)
    return answer.stdout if answer.returncode == 0 else ""


def inside(name: str, *words: str) -> str:
    """Run a command of `./stack` in a robot's container."""
    return podman("exec", f"telepresence-{name}", "/opt/telepresence/stack", *words)


def heading(name: str) -> float | None:
    """Where a simulated robot looks [rad]; None while nobody says."""
    text = inside(name, "exec", "timeout", "10", "rostopic", "echo", "-n1", "/truth/pose/pose/orientation")
    found = [re.search(rf"^{axis}: (\S+)", text, re.M) for axis in "zw"]
    return 2.0 * math.atan2(*(float(each[1]) for each in found if each)) if all(found) else None


def turns(name: str) -> bool:
    """Whether a robot turns."""
    before, after = heading(name), heading(name)
    return None not in (before, after) and abs(math.remainder(after - before, math.tau)) > 0.02


def stranger(site: RunningSite, name: str) -> Stranger:
    return Stranger(f"https://localhost:{site.port}/{name}/")


def pilot(site: RunningSite, name: str, token: str) -> Pilot:
    """Somebody who came by the link, picked this robot, and turns it all the time."""
    visitor = stranger(site, name)
    return Pilot(visitor, visitor.enter(name="Lena", invitation=token), TITLES[name], TURN)


def check(site: RunningSite) -> None:
    took = wait_for(lambda: site.said("^(anna|ben): is up", 2), "both containers are up")
    say("both containers are up", figure=f"{took:.1f} s")
    invited = re.search(rf"https://localhost:{site.port}/#i=(\S+)", inside("ben", "invite", "--drive"))
    say("a link that one container makes leads to the list", bool(invited))
    if invited is None:
        raise Failed("no link")
    with pilot(site, "ben", invited[1]) as second:
        with pilot(site, "anna", invited[1]):
            wait_for(lambda: turns("anna") and turns("ben"), "both robots drive")
            say("both robots drive, by one link")
        podman("kill", "telepresence-anna")
        killed = time.monotonic()
        wait_for(lambda: turns("ben"), "the second robot drives on", 30.0)
        wait_for(lambda: site.said("^anna: is up", 2), "the container comes back")
        say("the first container killed, the second robot drives on", not second.hung_up)
        say("the container is back", figure=f"{time.monotonic() - killed:.1f} s")
        with pilot(site, "anna", invited[1]):
            wait_for(lambda: turns("anna"), "its robot drives again")
            say("and its robot drives again")
            print(podman("stats", "--no-stream", "--format", "{{.Name}} {{.CPUPerc}} {{.MemUsage}}"), end="")
            site.process.send_signal(signal.SIGTERM)
            took = wait_for(lambda: site.process.poll() is not None, "the site ends", ENDS_WITHIN)
    say("SIGTERM ends all of it", site.process.returncode == 0, f"{took:.1f} s")
    left = podman("ps", "-a", "--format", "{{.Names}}").split()
    say("no container is left", not {"telepresence-anna", "telepresence-ben"} & {*left})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--image", default="telepresence")
    arguments = parser.parse_args()
    processes.adopt_orphans()
    site = None
    volume = f"telepresence-test-{secrets.token_hex(4)}"
    with tempfile.TemporaryDirectory(prefix="site-") as folder:
        os.environ.setdefault(
            "XDG_DATA_HOME", str(Path.home() / ".local/share")
        )  # podman's, whatever home the site has
        try:
            site = RunningSite(Path(folder), ROBOTS.format(image=arguments.image, volume=volume))
            check(site)
        except Failed as failed:
            wrong.append(str(failed))
            if site is not None:
                print("".join(site.lines[-20:]), file=sys.stderr)
        finally:
            if site is not None:
                processes.end(site.process, patience=30.0)
            processes.end_descendants()
            podman("volume", "rm", volume)
    print("\nThe site is as it should be." if not wrong else "\nNot as it should be: " + "; ".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
