"""Browsers cannot import Python: what the page's scripts have as constants of their own is what the window has."""

import json
import re

import pytest

from gui.driving import delay_speed_limit, drive_controls, gamepad, look_around
from gui.widgets import picture_patience, video_view
from telepresence.page import browser_messages, relays
from telepresence.page.app import STATIC
from telepresence.teleop import command_timeout, floor_goal, gaze, hand_speeds, joystick_mapping, lease_client
from telepresence.teleop.joystick_layouts import DEFAULT


def milliseconds(module, *names):
    return {name: 1000.0 * getattr(module, name) for name in names}


SHARED = {
    "held.js": {
        **{name: value for name, value in vars(hand_speeds).items() if name.isupper() and name != "USUAL_TURN"},
        "DEAD_ZONE": DEFAULT.dead_zone,
        "CURVE": DEFAULT.curve,
    },
    "gamepad.js": {
        "FAST": gamepad.FAST,
        "CREEP": DEFAULT.creep / hand_speeds.USUAL_SPEED,
        "STUCK": 1000.0 * joystick_mapping.STUCK_TIME,
    },
    "gaze.js": {
        "RATE": list(gaze.RATE),
        "STOPS": gaze.STOPS,
        "NEAR": gaze.NEAR,
        "PATIENCE": 1000.0 * gaze.PATIENCE,
    },
    "looking.js": {"TURNED": look_around.TURNED},
    "delay.js": {
        **milliseconds(delay_speed_limit, "HALF_FROM", "STOP_FROM", "WINDOW", "FORGET_AFTER"),
        **milliseconds(picture_patience, "LEAST_PATIENCE", "MOST_PATIENCE"),
        "PERIODS": picture_patience.PERIODS,
        "REMEMBERED": picture_patience.REMEMBERED,
        "FEWEST": picture_patience.FEWEST,
    },
    "driving.js": {"PANIC": 1000.0 * drive_controls.PANIC_TIME},
    "link.js": {"STALE": 1000.0 * video_view.STALE_AFTER, "FRESH": 750.0 * relays.LIFE},
    "overlay.js": {"SLOW": floor_goal.SLOW, "BLOCKED": floor_goal.BLOCKED},
    "page.js": {
        "TICK": 1000.0 * command_timeout.SEND_PERIOD,
        "LIFE": 1000.0 * lease_client.LIFE_PERIOD,
        **milliseconds(browser_messages, "SILENCE"),
    },
}
"""Script -> its constants that the window has, too, or the station; the scripts' times are milliseconds."""
OWN = {
    "held.js": set(),
    "gaze.js": {"STEP", "SPAN"},
    "delay.js": {"MOST_UNANSWERED"},
}
"""Script that does what a module of the window does -> the constants that it alone has."""


def constants(script):
    found = re.findall(
        r"^(?:export )?const ([A-Z_]+) = ([\d.]+|\[[-\d., ]+\]);", (STATIC / script).read_text(), re.MULTILINE
    )
    return {name: json.loads(number) for name, number in found}


@pytest.mark.parametrize(("script", "shared"), SHARED.items(), ids=SHARED)
def test_a_script_has_the_windows_numbers(script, shared):
    found = constants(script)
    assert {name: found.get(name) for name in shared} == shared


@pytest.mark.parametrize(("script", "own"), OWN.items(), ids=OWN)
def test_no_number_of_a_script_is_left_out_here(script, own):
    assert set(constants(script)) == set(SHARED[script]) | own
