"""ALLeds: the lights of eyes, ears and shoulders.

Every LED's state is in ALMemory; the simulated body shows the mean colour of the eyes and of the shoulders. A call that
fades ends with the fade. An LED that gets a new command while it fades continues from its present intensity.
"""

from __future__ import annotations

import bisect
import concurrent.futures
import math
import random
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pepper_sim.naoqi.led_names import EAR_STEP, GROUPS, LEDS, RGB, angle, channel, coloured
from pepper_sim.naoqi.memory_keys import Reader
from pepper_sim.naoqi.service import Module, ServiceError, finite, one_of, remote, shown, within
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.robot import Pepper

MAX_GROUPS = 1000
MAX_DURATION = 3600.0
_MAX_STEPS = 100
_MAX_TURNS = 500
_SHOW_STEP = 0.25
"""Time from colour to colour in randomEyes and rasta [s]."""
_BODY_PERIOD = 0.05
_BODY_LIGHTS = {"eyes": "FaceLeds", "shoulders": "ChestLeds"}
"""Light of the simulated body -> group of LEDs whose mean colour it shows."""


@dataclass(frozen=True)
class _Course:
    """Intensity over time: straight lines between points (time [s, monotonic], intensity), constant after the last."""

    points: tuple[tuple[float, float], ...]

    @property
    def end(self) -> float:
        return self.points[-1][0]

    def at(self, now: float) -> float:
        if now >= self.end:
            return self.points[-1][1]
        index = bisect.bisect_right(self.points, (now, math.inf))
        if index == 0:
            return self.points[0][1]
        (begin, start), (end, target) = self.points[index - 1 : index + 1]
        return start + (now - begin) / (end - begin) * (target - start) if end > begin else target


class ALLeds(Module):
    """Switches and fades LEDs."""

    name = "ALLeds"

    def __init__(self, robot: Pepper, alarm: Alarm) -> None:
        self._robot = robot
        self._alarm = alarm
        self._lock = threading.Lock()
        self._fades = dict.fromkeys(LEDS, _Course(((0.0, 1.0),)))  # as after reset()
        self._groups = {name: list(leds) for name, leds in GROUPS.items()}
        self._random = random.Random(0)
        self._changed = threading.Event()
        self._changed.set()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._light_body, name="leds", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closing.set()
        self._changed.set()
        self._thread.join(timeout=2.0)

    def memory_keys(self) -> dict[str, Reader]:
        """Return the ALMemory keys of the LEDs."""
        return {f"Device/SubDeviceList/{led}/Actuator/Value": self._reader(led) for led in LEDS}

    # --- switching ---------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def on(self, name: str) -> None:
        """Switches an LED or group fully on."""
        self._set(self._leds(name), 1.0, 0.0)

    @remote("v(s)")
    def off(self, name: str) -> None:
        """Switches an LED or group off."""
        self._set(self._leds(name), 0.0, 0.0)

    @remote("v(sf)")
    def setIntensity(self, name: str, intensity: float) -> None:
        """Sets the intensity of an LED or group, 0 to 1."""
        self._set(self._leds(name), within(intensity, 0.0, 1.0, "intensity"), 0.0)

    @remote("m(s)")
    def getIntensity(self, name: str) -> float | list[float]:
        """Returns the intensity of an LED, or for a group the list of intensities."""
        now = time.monotonic()
        values = [self._fades[led].at(now) for led in self._leds(name)]
        return values[0] if name in self._fades else values

    @remote("v(s)")
    def reset(self, name: str) -> None:
        """Sets an LED or group to its default state: white, ears on."""
        self._set(self._leds(name), 1.0, 0.0)

    # --- fading ------------------------------------------------------------------------------------------------------

    @remote("v(sff)")
    def fade(self, name: str, intensity: float, duration: float) -> concurrent.futures.Future:
        """Fades to an intensity, 0 to 1, within a time [s]; ends with it."""
        return self._set(self._leds(name), within(intensity, 0.0, 1.0, "intensity"), _duration(duration))

    @remote("v(sif)")
    def fadeRGB(self, name: str, rgb: int, duration: float) -> concurrent.futures.Future:
        """Fades to a colour 0xRRGGBB within a time [s]; ends with it."""
        return self._colour(name, _split(rgb, "rgb"), duration)

    @remote("v(ssf)", name="fadeRGB")
    def fadeRGBByName(self, name: str, colorName: str, duration: float) -> concurrent.futures.Future:
        """Fades to a named colour within a time [s]; ends with it."""
        return self._colour(name, RGB[one_of(colorName, RGB, "colorName")], duration)

    @remote("v(sffff)", name="fadeRGB")
    def fadeRGBByParts(
        self, name: str, red: float, green: float, blue: float, duration: float
    ) -> concurrent.futures.Future:
        """Fades to red, green and blue, 0 to 1, or 0 to 255 if one is above 1, within a time [s]; ends with it."""
        scale = 255.0 if max(red, green, blue) > 1.0 else 1.0
        parts = (("red", red), ("green", green), ("blue", blue))
        return self._colour(name, tuple(within(value, 0.0, scale, part) / scale for part, value in parts), duration)

    @remote("v(smm)")
    def fadeListRGB(self, name: str, rgbList: Any, timeList: Any) -> concurrent.futures.Future:
        """Fades through colours 0xRRGGBB, each reached at its time [s]; ends with the last."""
        if not isinstance(rgbList, list | tuple) or not isinstance(timeList, list | tuple):
            raise ServiceError(f"rgbList and timeList must be lists, got {shown(rgbList)} and {shown(timeList)}")
        if len(rgbList) != len(timeList) or not 0 < len(rgbList) <= _MAX_STEPS:
            raise ServiceError(f"rgbList and timeList must have the same length, 1 to {_MAX_STEPS}")
        colours = [_split(colour, f"rgbList[{index}]") for index, colour in enumerate(rgbList)]
        times = [_duration(finite(moment, f"timeList[{index}]")) for index, moment in enumerate(timeList)]
        if times != sorted(times):
            raise ServiceError(f"timeList must rise, got {shown(times)}")
        return self._show(
            self._leds(name),
            lambda led: [(moment, colour[channel(led)]) for moment, colour in zip(times, colours, strict=True)],
        )

    @remote("v(iff)")
    def rotateEyes(self, rgb: int, timeForRotation: float, totalDuration: float) -> concurrent.futures.Future:
        """Turns a colour around the eyes, one turn in timeForRotation [s]; ends after totalDuration [s]."""
        turn = within(timeForRotation, 0.01, MAX_DURATION, "timeForRotation")
        duration = _duration(totalDuration)
        colour = _split(rgb, "rgb")
        turns = min(math.ceil(duration / turn), _MAX_TURNS)

        def course(led: str) -> list[tuple[float, float]]:
            lit = colour[channel(led)]
            begin = angle(led) / 360.0 * turn
            points = []
            for number in range(turns):
                on = number * turn + begin
                points += [(on, 0.0), (on, lit), (on + turn / 8.0, lit), (on + turn / 8.0, 0.0)]
            return [point for point in points if point[0] < duration]

        return self._show(self._leds("FaceLeds"), course, duration)

    @remote("v(f)")
    def randomEyes(self, duration: float) -> concurrent.futures.Future:
        """Gives the eyes one random colour after the other; ends after a time [s]."""
        duration = _duration(duration)
        steps = min(max(1, round(duration / _SHOW_STEP)), _MAX_STEPS)
        moments = [duration * step / steps for step in range(steps)]
        return self._show(
            self._leds("FaceLeds"), lambda _: [(moment, self._random.random()) for moment in moments], duration
        )

    @remote("v(f)")
    def rasta(self, duration: float) -> concurrent.futures.Future:
        """Shows green, yellow and red in turn on the whole body; ends after a time [s]."""
        duration = _duration(duration)
        steps = min(max(3, round(duration / _SHOW_STEP)), _MAX_STEPS)
        colours = [RGB[("green", "yellow", "red")[step % 3]] for step in range(steps)]

        def course(led: str) -> list[tuple[float, float]]:
            points = []
            for step, colour in enumerate(colours):
                value = colour[channel(led)] if coloured(led) else float(step % 2)
                points += [(duration * step / steps, value), (duration * (step + 1) / steps, value)]
            return points

        return self._show(list(LEDS), course, duration)

    @remote("v(ifb)")
    def earLedsSetAngle(self, degrees: int, duration: float, leaveOnAtEnd: bool) -> concurrent.futures.Future:
        """Shows a direction with the ears within a time [s]: 0 is up, 90 forwards, 180 down, 270 back."""
        duration = _duration(duration)
        goal = degrees % 360

        def course(led: str) -> list[tuple[float, float]]:
            place = angle(led)
            last = abs((place - goal + 180) % 360 - 180) <= EAR_STEP / 2
            if place > goal and not last:
                return [(0.0, 0.0)]
            on = duration * min(place, goal) / max(goal, 1)
            off = duration if last else min(duration, on + duration * EAR_STEP / max(goal, EAR_STEP))
            return [(0.0, 0.0), (on, 0.0), (on, 1.0), (off, 1.0), (off, 1.0 if last and leaveOnAtEnd else 0.0)]

        return self._show(self._leds("EarLeds"), course)

    def blink(self, name: str, duration: float) -> None:
        """Darken a group for a moment, for the autonomous blinking; not while something else changes it."""
        now = time.monotonic()
        leds = self._leds(name)
        with self._lock:
            if any(self._fades[led].end > now for led in leds):
                return
            for led in leds:
                lit = self._fades[led].at(now)
                edges = ((0.0, lit), (0.2, 0.0), (0.8, 0.0), (1.0, lit))
                self._fades[led] = _Course(tuple((now + share * duration, value) for share, value in edges))
        self._changed.set()

    # --- groups ------------------------------------------------------------------------------------------------------

    @remote("v(s[s])")
    def createGroup(self, groupName: str, ledNames: list[str]) -> None:
        """Makes a group of LEDs or groups."""
        members = [led for name in ledNames for led in self._leds(name)]
        with self._lock:
            if len(self._groups) >= MAX_GROUPS:
                raise ServiceError(f"there are {MAX_GROUPS} groups already")
            self._groups[groupName] = members

    @remote("[s]()")
    def listGroups(self) -> list[str]:
        """Lists the groups."""
        return sorted(self._groups)

    @remote("[s](s)")
    def listGroup(self, groupName: str) -> list[str]:
        """Lists the LEDs of a group."""
        return list(self._groups[one_of(groupName, self._groups, "groupName")])

    @remote("[s](s)")
    def listLED(self, arg1: str) -> list[str]:
        """Lists the devices of an LED or group, "Face/Led/Red/Left/0Deg/Actuator/Value"."""
        return [f"{led}/Actuator/Value" for led in self._leds(arg1)]

    @remote("[s]()")
    def listLEDs(self) -> list[str]:
        """Lists the LEDs."""
        return list(LEDS)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _reader(self, led: str) -> Reader:
        return lambda _: self._fades[led].at(time.monotonic())

    def _leds(self, name: str) -> list[str]:
        name = name.removeprefix("Device/SubDeviceList/").removesuffix("/Actuator/Value")
        if name in self._fades:
            return [name]
        if name not in self._groups:
            raise ServiceError(f"name: unknown LED or group '{shown(name)[1:-1]}'")
        return self._groups[name]

    def _set(self, leds: list[str], target: float, duration: float) -> concurrent.futures.Future:
        now = time.monotonic()
        with self._lock:
            for led in leds:
                self._fades[led] = _Course(((now, self._fades[led].at(now)), (now + duration, target)))
        self._changed.set()
        return self._alarm.after(duration)

    def _colour(self, name: str, rgb: tuple[float, ...], duration: float) -> concurrent.futures.Future:
        duration = _duration(duration)
        leds = self._leds(name)
        for index, part in enumerate(rgb):
            self._set([led for led in leds if channel(led) == index], part, duration)
        return self._alarm.after(duration)

    def _show(
        self, leds: list[str], course: Callable[[str], list[tuple[float, float]]], duration: float = 0.0
    ) -> concurrent.futures.Future:
        """Lead LEDs through (seconds from now, intensity); after `duration`, if given, they are as before."""
        now = time.monotonic()
        longest = duration
        with self._lock:
            for led in leds:
                before = self._fades[led].at(now)
                points = [(now, before), *((now + moment, value) for moment, value in course(led))]
                if duration:
                    points += [(now + duration, points[-1][1]), (now + duration, before)]
                longest = max(longest, points[-1][0] - now)
                self._fades[led] = _Course(tuple(points))
        self._changed.set()
        return self._alarm.after(longest)

    def _light_body(self) -> None:
        """Show the colours on the simulated body while they change."""
        while not self._closing.is_set():
            self._changed.wait()
            self._changed.clear()
            fading = True
            while fading and not self._closing.is_set():
                now = time.monotonic()
                for part, group in _BODY_LIGHTS.items():
                    self._robot.lights.colour(part, *self._mean_colour(group, now))
                fading = any(fade.end > now for fade in self._fades.values())
                if fading:
                    self._closing.wait(_BODY_PERIOD)

    def _mean_colour(self, group: str, now: float) -> list[float]:
        parts: list[list[float]] = [[], [], []]
        for led in GROUPS[group]:
            parts[channel(led)].append(self._fades[led].at(now))
        return [sum(part) / len(part) for part in parts]


def _duration(value: float) -> float:
    return within(value, 0.0, MAX_DURATION, "duration")


def _split(rgb: Any, argument: str) -> tuple[float, float, float]:
    if not isinstance(rgb, int) or not 0 <= rgb <= 0xFFFFFF:
        raise ServiceError(f"{argument} must be a colour 0x000000 to 0xFFFFFF, got {shown(rgb)}")
    return (rgb >> 16 & 255) / 255.0, (rgb >> 8 & 255) / 255.0, (rgb & 255) / 255.0
