"""Whether a site of two robots is what docs/site.md promises: some two minutes, and not in `.ci/run`.

    ./stack exec python tests/site [--json FILE] [--record]

Two simulated robots stand outside, as real ones do, and are looked at by their own wires. `./stack site up` has a unit
for each, and Caddy in front. Chromium opens the printed link, picks the first robot in the list and drives it; a second
person drives the other one. Then units and proxy are killed and frozen, and at last the site is asked to end while both
robots drive.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "lab"), str(TESTS / "bench")]

import figures as record  # noqa: E402
from free_ports import free_port  # noqa: E402
from newcomer import DESKTOP, Newcomer  # noqa: E402
from page_stranger import Pilot, Stranger  # noqa: E402
from site_in_test import Failed, RunningSite, command, figures, say, wait_for, wrong  # noqa: E402
from soak.samples import sample  # noqa: E402

from telepresence import naoqi  # noqa: E402
from telepresence.site.site_file import PORTS_OF_ONE  # noqa: E402
from telepresence.station import processes  # noqa: E402
from telepresence.station.fault_sentences import UNREACHABLE  # noqa: E402
from telepresence.station.health import Unhealthy, drive_states  # noqa: E402
from telepresence.teleop.accounts import Users  # noqa: E402

ENDS_WITHIN = 20.0
"""[s]"""
MEASURED = 20.0
"""[s] for which processor time is counted."""
FIRST_PORT = 22000
WINDOWS = {"libQt5Core", "libQt5Gui"}
"""Libraries of what has a window; FFmpeg and GStreamer have X11's loaded, too."""
OF_WINDOWS = ("Xvfb ", "xterm ", "tmux ")
TURN = [0.0, 0.0, 0.4]
MOVED = 0.05
"""[m, rad]"""
RESTS = 0.5
"""[s] without moving."""
SITE = """\
first_port = {first}

[robot.anna]
title = "Anna"
kind = "pepper"
settings = {{ sim = false, nao_ip = "127.0.0.1", nao_port = {pepper}, sign_in = false, source = "test" }}

[robot.ben]
title = "Ben"
kind = "robotino"
[robot.ben.settings]
sim = false
robotino_ip = "127.0.0.1"
robotino_port = {robotino}
sign_in = false
camera = "cam0"
voice = false
"""


class Robots:
    """A Pepper and a Robotino that know of no site."""

    def __init__(self) -> None:
        self.ports = {"pepper": free_port(), "robotino": free_port()}
        self._programs = [
            processes.start(
                [
                    sys.executable,
                    "-m",
                    "telepresence.sim",
                    "--scene",
                    scene,
                    "--robot",
                    f"{kind}:{kind}:{self.ports[kind]}",
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            for kind, scene in (("pepper", "flat"), ("robotino", "flat"))
        ]
        self._session = naoqi.Session()
        wait_for(self._connects, "the simulated Pepper answers")
        self._motion = self._session.service("ALMotion")
        wait_for(self._robotino_answers, "the simulated Robotino answers")

    def _connects(self) -> bool:
        with contextlib.suppress(RuntimeError):
            self._session.connect(f"tcp://127.0.0.1:{self.ports['pepper']}")
        return self._session.isConnected()

    def _robotino_answers(self) -> bool:
        with contextlib.suppress(OSError):
            return bool(self.place("ben"))
        return False

    def place(self, name: str) -> list[float]:
        """Return where a robot's own odometry has it: x, y, theta [m, rad]."""
        if name == "anna":
            return list(self._motion.getRobotPosition(True))
        with urllib.request.urlopen(f"http://127.0.0.1:{self.ports['robotino']}/data/odometry", timeout=5.0) as answer:
            return json.load(answer)[:3]

    def moves(self, name: str) -> Callable[[], bool]:
        """Return whether a robot moves from where it is now."""
        begin = self.place(name)
        return lambda: distance(begin, self.place(name)) > MOVED

    def rests(self, name: str) -> bool:
        """Return whether a robot stands still for a moment."""
        begin = self.place(name)
        time.sleep(RESTS)
        return distance(begin, self.place(name)) < 0.01

    def close(self) -> None:
        self._session.close()
        for program in self._programs:
            processes.end(program)


def distance(a: list[float], b: list[float]) -> float:
    """Metres or radians, whatever is more."""
    return max(math.dist(a[:2], b[:2]), abs(math.remainder(a[2] - b[2], math.tau)))


def check_up(site: RunningSite) -> None:
    """Both units, with everything that belongs to them, and nothing that has a window."""
    wait_for(lambda: site.said("^(anna|ben): is up", 2), "both units are up")
    figures["both up [s]"] = round(time.monotonic() - site.started, 1)
    say("both units are up", figure=f"{figures['both up [s]']} s")
    for port in (FIRST_PORT, FIRST_PORT + PORTS_OF_ONE):
        wait_for(lambda port=port: has_its_robot(port), "a driver has its robot")
    of_windows = [
        command(pid)
        for pid in processes.descendants(site.process.pid)
        if WINDOWS & libraries(pid) or command(pid).startswith(OF_WINDOWS)
    ]
    say("nothing there has a window", not of_windows, " ".join(of_windows)[:300])


def has_its_robot(master_port: int) -> bool:
    """Whether the driver at this ROS master has connected to its robot."""
    try:
        states = dict(drive_states(f"http://127.0.0.1:{master_port}"))
    except Unhealthy:
        return False
    return bool(states) and not any(state.startswith(UNREACHABLE) for state in states.values())


def libraries(pid: int) -> set[str]:
    """Return the names of the libraries that a process has loaded, up to the first dot or hyphen."""
    try:
        lines = Path(f"/proc/{pid}/maps").read_text().splitlines()
    except OSError:
        return set()
    return {re.split("[.-]", Path(line.split()[5]).name)[0] for line in lines if len(line.split()) > 5}


def check_picked(site: RunningSite, robots: Robots, newcomer: Newcomer) -> None:
    """The printed link, the list, the robot."""
    newcomer.tap(site.link)
    seen = "[...document.querySelectorAll('.state')].map((e) => e.textContent).join()"
    wait_for(lambda: newcomer.evaluate(seen) == "there,there", "the list shows both robots")
    newcomer.press('a[href="anna/"]')
    wait_for(newcomer.is_there, "the page of the first robot shows a picture")
    drives(robots, newcomer)
    say("picked in the list, the first robot drives")
    newcomer.let_go()
    wait_for(lambda: robots.rests("anna"), "it stands when the key is released")


def drives(robots: Robots, newcomer: Newcomer) -> float:
    """Hold forward, again and again, until the first robot moves; return after how many seconds."""
    moves, pressed = robots.moves("anna"), -math.inf

    def hold() -> bool:
        nonlocal pressed
        if time.monotonic() - pressed > 2.0:  # a page that was away for a moment lets go
            pressed = time.monotonic()
            newcomer.let_go()
            newcomer.hold_forward()
        return moves()

    return wait_for(hold, "the first robot drives")


@contextlib.contextmanager
def second_pilot(site: RunningSite, robots: Robots) -> Iterator[Pilot]:
    """Somebody else turns the other robot all the time, by the websocket."""
    stranger = Stranger(f"https://localhost:{site.port}/ben/")
    cookie = stranger.enter(name="", invitation=site.link.partition("#k=")[2])
    with Pilot(stranger, cookie, "Robotino", TURN) as pilot:
        wait_for(robots.moves("ben"), "the second robot drives")
        yield pilot


def measure(site: RunningSite, when: str) -> None:
    """Count processor time and memory of each unit, and of the proxy."""
    pids = {name: [site.unit(name), *processes.descendants(site.unit(name))] for name in ("anna", "ben")}
    pids["proxy"] = [site.proxy]
    before = {name: _total(each)[0] for name, each in pids.items()}
    begin = time.monotonic()
    time.sleep(MEASURED)
    passed = time.monotonic() - begin
    for name, each in pids.items():
        cpu, pss = _total(each)
        share = (cpu - before[name]) / passed
        figures[f"{name}, {when}: cores"] = round(share, 3)
        figures[f"{name}, {when}: MB"] = round(pss)
        say(f"{name}, {when}", figure=f"{share:.2f} cores, {pss:.0f} MB, {len(each)} processes")


def _total(pids: list[int]) -> tuple[float, float]:
    """Processor time [s] and proportional memory (PSS) [MB]."""
    usages = sample(pids).values()
    return sum(usage.cpu for usage in usages), sum(usage.pss for usage in usages) / 1024


def check_killed_unit(site: RunningSite, robots: Robots, newcomer: Newcomer, second: Pilot) -> None:
    """Every program of the first unit is killed while both robots drive."""
    drives(robots, newcomer)
    unit = site.unit("anna")
    for pid in [unit, *processes.descendants(unit)]:
        processes.send(pid, signal.SIGKILL)
    killed = time.monotonic()
    pictures = second.pictures
    wait_for(robots.moves("ben"), "the second robot drives on", 5.0)
    wait_for(lambda: robots.rests("anna"), "the first robot stands", 15.0)
    say("its unit killed, the first robot stands, and the second one drives on")
    wait_for(lambda: site.said("^anna: is up", 2), "the unit comes back")
    figures["unit up again [s]"] = round(time.monotonic() - killed, 1)
    newcomer.let_go()
    wait_for(newcomer.is_there, "the page has picture and robot again, by itself")
    drives(robots, newcomer)
    figures["driven again [s]"] = round(time.monotonic() - killed, 1)
    say("the unit is back, and its robot drives by the same page",
        figure=f"up after {figures['unit up again [s]']} s, driven after {figures['driven again [s]']} s")  # fmt: skip
    say("the second pilot noticed nothing", not second.hung_up and second.pictures > pictures)
    newcomer.let_go()


def check_frozen_unit(site: RunningSite) -> None:
    """Whoever stopped the first program of a unit stopped it all; the site notices."""
    os.kill(site.unit("anna"), signal.SIGSTOP)
    figures["frozen unit back [s]"] = round(
        wait_for(lambda: site.said("^anna: is up", 3), "a frozen unit comes back"), 1
    )
    say("a frozen unit is back", figure=f"{figures['frozen unit back [s]']} s")


def check_killed_proxy(site: RunningSite, robots: Robots, newcomer: Newcomer) -> None:
    """Caddy dies; the page dials again, and its person is still in."""
    wait_for(newcomer.is_there, "the page is there")
    os.kill(site.proxy, signal.SIGKILL)
    killed = time.monotonic()
    stranger = Stranger(f"https://localhost:{site.port}/ben/")

    def answers() -> bool:
        with contextlib.suppress(OSError):
            return stranger.ask("GET", "/me")[0] == 401
        return False

    wait_for(answers, "the proxy is back", 15.0)
    figures["proxy back [s]"] = round(time.monotonic() - killed, 1)
    say("a killed proxy is back", figure=f"{figures['proxy back [s]']} s")
    drives(robots, newcomer)
    say("and the page drives on")
    newcomer.let_go()


def check_end(site: RunningSite, robots: Robots, newcomer: Newcomer) -> None:
    """SIGTERM while both robots drive."""
    tree = processes.descendants(site.process.pid)
    drives(robots, newcomer)
    with second_pilot(site, robots):
        site.process.send_signal(signal.SIGTERM)
        asked = moved = time.monotonic()
        places = {name: robots.place(name) for name in ("anna", "ben")}
        while site.process.poll() is None:
            for name, before in places.items():
                places[name] = robots.place(name)
                if distance(before, places[name]) > 0.001:
                    moved = time.monotonic()
            if time.monotonic() - asked > ENDS_WITHIN:
                raise Failed(f"the site does not end within {ENDS_WITHIN:.0f} s")
            time.sleep(0.05)
    figures["ended [s]"], figures["at rest [s]"] = round(time.monotonic() - asked, 1), round(moved - asked, 1)
    how = f"{figures['ended [s]']} s; both robots at rest after {figures['at rest [s]']} s"
    say("SIGTERM ends all of it", site.process.returncode == 0, how)
    say("both robots stay at rest", robots.rests("anna") and robots.rests("ben"))
    left = [command(pid) for pid in tree if command(pid)]
    say("nothing is left", not left, " ".join(left)[:300])


def main() -> int:
    parser = argparse.ArgumentParser(prog="./stack exec python tests/site", description=__doc__.partition("\n")[0])
    parser.add_argument("--json", type=Path, help="write the figures there, too")
    parser.add_argument("--record", action="store_true", help="and into docs/measured/site.json and docs/site.md")
    arguments = parser.parse_args()
    processes.adopt_orphans()
    newcomer = site = robots = None
    with tempfile.TemporaryDirectory(prefix="site-") as folder:
        Users(Path(folder, "users.db")).all()
        try:
            robots = Robots()
            site = RunningSite(Path(folder), SITE.format(first=FIRST_PORT, **robots.ports))
            check_up(site)
            measure(site, "nobody looks")
            newcomer = Newcomer(DESKTOP)
            check_picked(site, robots, newcomer)
            with second_pilot(site, robots) as second:
                measure(site, "watched")
                check_killed_unit(site, robots, newcomer, second)
            check_frozen_unit(site)
            check_killed_proxy(site, robots, newcomer)
            check_end(site, robots, newcomer)
            say("the page had no error", not newcomer.errors, str(newcomer.errors)[:300])
        except Failed as failed:
            wrong.append(str(failed))
            if site is not None:
                print("".join(site.lines[-20:]), file=sys.stderr)
        finally:
            if newcomer is not None:
                newcomer.tools.close()
            if site is not None:
                processes.end(site.process, patience=30.0)
            if robots is not None:
                robots.close()
            processes.end_descendants()
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(figures, indent=1) + "\n")
    if arguments.record and not wrong:
        record.write(figures)
    print("\nThe site is as it should be." if not wrong else "\nNot as it should be: " + "; ".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
