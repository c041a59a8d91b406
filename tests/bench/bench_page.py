"""The pilot's page in Chromium: age of the picture, key to setpoint, and what viewers cost.

The age is read from the time that is drawn into each picture, when the browser hands the picture to its compositor;
against encoding, sending and decoding alone. The bad link is two network namespaces with 25 ms each way and 2 % loss.
A key goes through page or window to drive_lease and the driver, until ALMotion's setpoint of the simulated Pepper.
"""

from __future__ import annotations

import contextlib
import os
import queue
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "browser"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "lab"))

from floor import ages as floor_ages
from head import head_rows
from media.far_network import MASTER, FarNetwork
from report import Row, percentile
from ros_graph import free_port, private_environment, private_master, wait_for
from station import PageStation, picture_ages
from whole_station import whole_station

from pepper_sim.simulation import Simulation
from telepresence.station import processes
from telepresence.station.virtual_display import VirtualDisplay
from telepresence.teleop.invitations import Invitations, beside

FOLDER = Path(__file__).resolve().parent / "browser"
WARM_UP, SECONDS = 4.0, 20.0
SETTLES = 10.0
"""[s] until a station that was just started does nothing more than it does all day."""
DELAY, LOSS = 0.025, 0.02
"""Delay of the bad link, each way [s], and the share of packets that it loses."""
PRESSES = 60
COUNTS = (0, 1, 5, 10)
CPU_SECONDS = 8.0
MOST_OF_TEN = 1.3
"""Ten viewers may cost this many times one."""


def run() -> list[Row]:
    return [row for part in (loopback, bad_link, keys, head_rows, viewers) for row in part()]


def loopback() -> list[Row]:
    with private_master() as environment, page_station(environment) as station, station.browser() as browser:
        ages = picture_ages(browser, SECONDS, WARM_UP)
    return age_rows("loopback", ages, floor_ages(SECONDS))


def viewers() -> list[Row]:
    """What people who look cost the whole station."""
    whole, page = {}, {}
    with whole_station() as station:
        _, invitation = Invitations(beside(station.users)).make("watcher", 3600.0)
        time.sleep(SETTLES)
        for count in COUNTS:
            with viewing(count, station.url, invitation):
                time.sleep(WARM_UP)
                cores = station.cores(CPU_SECONDS)
            whole[count] = sum(cores.values())
            page[count] = sum(share for words, share in cores.items() if "pilot_page/pilot_page" in words)
    return [
        *(Row(f"station, {count} viewers", 100 * whole[count], 100 * whole[1], "%", "1 viewer") for count in COUNTS),
        *(
            Row(f"page's program, {count} viewers", 100 * page[count], 100 * page[1], "%", "1 viewer")
            for count in COUNTS
        ),
        Row("ten viewers, in ones", whole[10] / whole[1], MOST_OF_TEN, "", "wanted"),
    ]


@contextlib.contextmanager
def viewing(count: int, url: str, invitation: str) -> Iterator[None]:
    """Let so many people look."""
    if not count:
        yield
        return
    words = [sys.executable, str(FOLDER / "viewers.py"), url, invitation, str(count)]
    looking = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        if looking.stdout.readline() != "ready\n":
            raise RuntimeError(f"{count} viewers do not get pictures")
        yield
    finally:
        looking.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            looking.wait(5)
        looking.kill()
        looking.wait(10)
        looking.stdout.close()


def bad_link() -> list[Row]:
    """Pictures, and the floor with the link's delay."""
    network = FarNetwork(2)
    try:
        network.delay, network.loss = DELAY, LOSS
        here, there = network.machines
        with private_environment() as environment, far_chromium(there.command()):
            environment |= {"ROS_MASTER_URI": f"http://{MASTER}:11311", "ROS_IP": MASTER}
            master = processes.start(
                here.command("rosmaster", "--core", "-p", "11311"),
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                tied=True,
            )
            try:
                with page_station(environment, MASTER, tuple(here.command())) as station, station.browser() as browser:
                    ages = picture_ages(browser, SECONDS, WARM_UP)
            finally:
                processes.end(master)
    finally:
        network.close()
    return age_rows("50 ms there and back, 2 % loss", ages, [age + DELAY for age in floor_ages(SECONDS / 2)])


def age_rows(where: str, ages: list[float], floor: list[float]) -> list[Row]:
    return [
        Row(f"age, p{share}, {where}", percentile(ages, share) * 1e3, percentile(floor, share) * 1e3, "ms", "floor")
        for share in (50, 99)
    ]


@contextlib.contextmanager
def page_station(
    environment: dict[str, str], address: str = "127.0.0.1", before: tuple[str, ...] = (), sign_in: bool = True
) -> Iterator[PageStation]:
    station = PageStation(environment, free_port(), address, before, sign_in)
    try:
        yield station
    finally:
        station.close()


@contextlib.contextmanager
def far_chromium(command: list[str]) -> Iterator[None]:
    """Let the browser that is started next run on another machine."""
    with tempfile.TemporaryDirectory(prefix="bench-chromium-") as folder:
        program = Path(folder, "chromium")
        program.write_text(f'#!/bin/sh\nexec {" ".join(command)} {shutil.which("chromium")} "$@"\n')
        program.chmod(0o755)
        path = os.environ["PATH"]
        os.environ["PATH"] = f"{folder}:{path}"
        try:
            yield
        finally:
            os.environ["PATH"] = path


def keys() -> list[Row]:
    with private_master() as environment, Simulation(port=0) as simulation:
        port = simulation.url.rpartition(":")[2]
        driver = ("naoqi_driver_py", "naoqi_driver.launch", "nao_ip:=127.0.0.1", f"nao_port:={port}")
        with page_station(environment, sign_in=False) as station:
            station.start("roslaunch", *driver)
            setpoints = record(simulation)
            with station.browser() as browser:
                by_page = presses(lambda down: browser.key("KeyW", down), setpoints)
            with window(environment) as press:
                by_window = presses(press, setpoints)
    return [
        Row(f"key to setpoint, p{share}", percentile(by_page, share) * 1e3, percentile(by_window, share) * 1e3, "ms",
            "the window")
        for share in (50, 99)
    ]  # fmt: skip


def record(simulation: Simulation) -> queue.SimpleQueue[tuple[float, float]]:
    """Return where each setpoint of the robot comes, with its time."""
    setpoints: queue.SimpleQueue[tuple[float, float]] = queue.SimpleQueue()
    drive = simulation.robot.set_velocity

    def note(vx: float, vy: float, wz: float) -> None:
        setpoints.put((time.monotonic(), vx))
        drive(vx, vy, wz)

    simulation.robot.set_velocity = note
    return setpoints


def presses(press: Callable[[bool], None], setpoints: queue.SimpleQueue[tuple[float, float]]) -> list[float]:
    """Seconds from each press of the key to the robot's setpoint."""

    def open_way() -> bool:
        press(True)
        time.sleep(0.3)
        press(False)
        time.sleep(0.3)
        return any(vx > 0 for _, vx in drain(setpoints))

    wait_for(open_way, "the first setpoint")
    random.seed(1)
    taken = []
    for _ in range(PRESSES):
        time.sleep(random.uniform(0.3, 0.5))
        drain(setpoints)
        began = time.monotonic()
        press(True)
        while True:
            try:
                when, vx = setpoints.get(timeout=5.0)
            except queue.Empty:
                raise RuntimeError("a key did not reach the robot within 5 s") from None
            if when > began and vx > 0:
                taken.append(when - began)
                break
        press(False)
    return taken


def drain(setpoints: queue.SimpleQueue[tuple[float, float]]) -> list[tuple[float, float]]:
    found = []
    with contextlib.suppress(queue.Empty):
        while True:
            found.append(setpoints.get_nowait())
    return found


@contextlib.contextmanager
def window(environment: dict[str, str]) -> Iterator[Callable[[bool], None]]:
    """Yield what presses and releases W in the operator's window, on a screen of its own."""
    display = VirtualDisplay()
    try:
        shown = environment | {
            "DISPLAY": display.name,
            "XAUTHORITY": str(display.authority),
            "HOME": str(display.folder),
        }
        words = ("--profile", "pepper", "--gamepad", "none", "--attach", "--no-sign-in")
        started = processes.start(
            [sys.executable, "-m", "gui", *words],
            env=shown,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            tied=True,
        )
        hand = subprocess.Popen(["xdotool", "-"], env=shown, stdin=subprocess.PIPE, text=True)

        def do(words: str) -> None:
            hand.stdin.write(words + "\n")
            hand.stdin.flush()

        try:
            for line in started.stdout:
                if "first picture" in line:
                    break
            else:
                raise RuntimeError("the window has ended")
            time.sleep(WARM_UP)
            do("mousemove 60 84 click 1")
            yield lambda down: do("keydown w" if down else "keyup w")
        finally:
            hand.stdin.close()
            hand.wait(10)
            processes.end(started, patience=20.0)
            started.stdout.close()
    finally:
        display.close()
