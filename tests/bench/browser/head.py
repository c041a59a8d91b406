"""Looking around by the page, and holding the floor with the head turned, against where the simulated Pepper truly is.

A drag on the picture goes through page, drive_lease and driver to NAOqi, until the head's joint moves in the
simulation. Where a pixel of the picture is on the floor is computed from the simulated camera itself, without ROS.
"""

from __future__ import annotations

import math
import random
import time
from collections import deque

import numpy as np
from page_browser import Browser
from report import Row, percentile
from ros_graph import free_port, private_master, wait_for
from station import PageStation

from pepper_sim.simulation import Simulation

DRAGS = 30
DRAG = 80
"""[px] of the pointer: some 4 degrees."""
MOVED = math.radians(0.5)
"""Turn from which on the head counts as moving [rad]."""
MOTION_AIM, FLOOR_AIM = 0.150, 0.25
"""[s] and [m]"""
PERIOD = 0.005
"""[s] between two looks at the simulation."""
TRIES = 4
TURNS = (-0.5, 0.5, -0.9, 0.9)
"""[rad] by which the head is turned while the floor is held."""
NEARLY = 0.1
"""[rad]"""
STEP, STEPS = 15.0, 30
"""[px] of the pointer that turns the head, and how often before it takes hold again."""
NEAR, FAR = 1.0, 2.4
"""[m] from the robot to what is held."""
STANDS, ARRIVED = 1.0, 3.0
"""[s] without motion after which the head stands, and the robot is where it was to go: a late picture lets it wait."""
CAMERA = "CameraTop"


class TruePepper:
    """Where the robot and its head are in the simulation."""

    def __init__(self, simulation: Simulation) -> None:
        self._world, self._robot = simulation.world, simulation.robot
        prefix = simulation.simulated.model.prefix
        self._joint = int(self._world.model.joint(f"{prefix}HeadYaw").qposadr[0])
        self._root = int(self._world.model.joint(f"{prefix}root").qposadr[0])
        self._start = self._robot.truth()[:2]
        self._eye = self._world.model.camera(simulation.robot.cameras[CAMERA][0]).id
        self.seen: deque[tuple[float, float, float, float]] = deque(maxlen=round(60.0 / PERIOD))
        """Time [s, monotonic], yaw of the head [rad], x, y of the robot [m]."""
        self._world.every(PERIOD, self._note)

    def _note(self, _now: float) -> None:
        x, y, *_ = self._robot.truth()
        with self._world.locked() as data:
            self.seen.append((time.monotonic(), float(data.qpos[self._joint]), x, y))

    @property
    def yaw(self) -> float:
        return self.seen[-1][1]

    @property
    def place(self) -> tuple[float, float]:
        return self.seen[-1][2:]

    def moves_at(self, began: float) -> float | None:
        """When the head began to move after that time; None if it does not yet."""
        track = [(when, yaw) for when, yaw, *_ in list(self.seen) if when >= began]
        return next((when for when, yaw in track if abs(yaw - track[0][1]) > MOVED), None)

    def put_back(self) -> None:
        """Put the robot where it began, for there are walls; what it knows of its way is not touched."""
        with self._world.locked() as data:
            data.qpos[self._root : self._root + 2] = self._start

    def stands(self, seconds: float = STANDS) -> bool:
        """Whether neither robot nor head has moved for so long."""
        recent = [fields for when, *fields in list(self.seen) if when > time.monotonic() - seconds]
        return len(recent) > 2 and bool(np.all(np.ptp(np.array(recent), axis=0) < (0.005, 0.01, 0.01)))

    def floor_at(self, u: float, v: float, aspect: float) -> tuple[float, float] | None:
        """Return which place of the floor a share of the picture shows [m]; None above the horizon.

        Args:
            aspect: The picture's width by its height.
        """
        model = self._world.model
        up = math.tan(math.radians(float(model.cam_fovy[self._eye])) / 2.0)
        with self._world.locked() as data:
            eye = data.cam_xpos[self._eye].copy()
            ray = data.cam_xmat[self._eye].reshape(3, 3) @ ((2 * u - 1) * up * aspect, (1 - 2 * v) * up, -1.0)
        if ray[2] > -0.05:
            return None
        x, y, _ = eye - ray * eye[2] / ray[2]
        return float(x), float(y)


def head_rows() -> list[Row]:
    """Drag to motion of the head, and how far from the point that is held the robot stops."""
    with private_master() as environment, Simulation("empty", port=0) as simulation:
        truth = TruePepper(simulation)
        station = PageStation(environment, free_port(), sign_in=False, camera=False)
        try:
            port = simulation.url.rpartition(":")[2]
            words = ("pepper_bringup", "pepper_full_py.launch", "nao_ip:=127.0.0.1", f"nao_port:={port}")
            station.start("roslaunch", *words)
            with station.browser() as browser:
                wait_for(lambda: browser.evaluate("!document.getElementById('lookPad').hidden"), "the head")
                hand = Hand(browser)
                motions = drags(hand, truth)
                misses, presses = zip(*(hold_the_floor(hand, truth, turn) for turn in TURNS), strict=True)
        finally:
            station.close()
    return [
        *(Row(f"drag to motion of the head, p{share}", percentile(motions, share) * 1e3, MOTION_AIM * 1e3, "ms",
              "wanted") for share in (50, 95)),
        Row("floor held, head turned: worst miss", max(misses), FLOOR_AIM, "m", "wanted"),
        Row("floor held, head turned: presses", sum(presses), len(TURNS), "", "places"),
    ]  # fmt: skip


class Hand:
    """A mouse on the picture."""

    def __init__(self, browser: Browser) -> None:
        self._tools, self._browser = browser.tools, browser
        box, size = "document.getElementById('picture').getBoundingClientRect()", "document.getElementById('picture')"
        self._box = browser.evaluate(f"(({{left, top, width, height}}) => [left, top, width, height])({box})")
        self.aspect = browser.evaluate(f"{size}.videoWidth / {size}.videoHeight")

    def at(self, u: float, v: float) -> tuple[float, float]:
        left, top, width, height = self._box
        return left + u * width, top + v * height

    def holds_the_floor(self) -> bool:
        """Whether the robot still has its place: a machine too busy to run page or station for a while ends a hold."""
        return self._browser.evaluate("document.getElementById('floorWay').classList.contains('shown')")

    def is_on_picture(self, u: float, v: float) -> bool:
        x, y = self.at(u, v)
        return self._browser.evaluate(f"document.elementFromPoint({x}, {y})?.id === 'picture'")

    def do(self, kind: str, x: float, y: float) -> None:
        held = 0 if kind == "mouseReleased" else 1
        self._tools.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=held, clickCount=1)


def drags(hand: Hand, truth: TruePepper) -> list[float]:
    """Seconds from each drag of the pointer until the head moves."""
    x, y = hand.at(0.5, 0.5)
    random.seed(1)

    def drag(step: float) -> float:
        wait_for(lambda: truth.stands(0.3), "the head stands")
        time.sleep(random.uniform(0.0, 0.1))
        hand.do("mousePressed", x, y)
        began = time.monotonic()
        hand.do("mouseMoved", x + step, y)
        try:
            wait_for(lambda: truth.moves_at(began) is not None, "the head moves", timeout=5.0)
        finally:
            hand.do("mouseReleased", x + step, y)
        return truth.moves_at(began) - began

    def opens_way() -> bool:
        try:
            return drag(DRAG) > 0.0
        except RuntimeError:
            return False

    wait_for(opens_way, "the first drag turns the head")
    return [drag(DRAG if number % 2 else -DRAG) for number in range(DRAGS)]


def hold_the_floor(hand: Hand, truth: TruePepper, turn: float) -> tuple[float, int]:
    """Turn the head, hold a place on the floor until the robot stands; return how far from it that is [m], and how
    many presses it took."""
    for press in range(1, TRIES + 1):
        truth.put_back()
        turn_head(hand, truth, turn)
        u, v, place = nearest(hand, truth)
        hand.do("mousePressed", *hand.at(u, v))
        try:
            time.sleep(ARRIVED)
            wait_for(lambda: truth.stands(ARRIVED), "the robot has arrived")
            if hand.holds_the_floor():
                return math.dist(truth.place, place), press
        finally:
            hand.do("mouseReleased", *hand.at(u, v))
    return math.inf, TRIES


def turn_head(hand: Hand, truth: TruePepper, turn: float) -> None:
    """Drag the picture until the head looks there [rad]: what was under the pointer stays under it."""
    x, y = hand.at(0.5, 0.5)
    while abs(truth.yaw - turn) > NEARLY:
        way = math.copysign(STEP, turn - truth.yaw)
        hand.do("mousePressed", x, y)
        for number in range(1, STEPS):
            hand.do("mouseMoved", x + number * way, y)
            time.sleep(0.05)
            if abs(truth.yaw - turn) < NEARLY:
                break
        hand.do("mouseReleased", x + number * way, y)
        wait_for(truth.stands, "the head stands")


def nearest(hand: Hand, truth: TruePepper) -> tuple[float, float, tuple[float, float]]:
    """Return a share of the picture that shows the floor not far away, and which place that is [m]."""
    for v in np.arange(0.95, 0.4, -0.05):
        for u in (0.5, 0.4, 0.6):
            place = truth.floor_at(u, v, hand.aspect)
            if place and NEAR < math.dist(place, truth.place) < FAR and hand.is_on_picture(u, v):
                return float(u), float(v), place
    raise RuntimeError("the picture shows no floor nearby")
