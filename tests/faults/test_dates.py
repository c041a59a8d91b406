"""Nothing waits or judges an age by the date, which jumps when somebody sets the clock.

Who asks for the date stamps something with it, or is named here with what happens when it jumps.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("telepresence", "gui", "pepper_sim", "robotino_sim", "catkin_ws/src")
DATES = {"time.time", "rospy.Time.now", "rospy.get_time", "rospy.get_rostime", "rospy.Rate", "datetime.now"}
"""rospy's clock is the date too, and so is that of its Rate."""
COMPARED = {
    "telepresence/station/doctor.py": "the difference of two machines' clocks is what it reports",
    "gui/app/controller.py": "the times of day in the list of faults",
    "gui/app/fault_watch.py": "a fault from before the window began; 5 s later it is not news",
    "telepresence/page/browser_link.py": "the age of a picture, which is shown and nothing else",
    "telepresence/page/browser_socket.py": "likewise",
    "telepresence/page/sign_in_routes.py": "how long a link lasts, which is shown and nothing else",
    "telepresence/page/floor.py": "the age of a picture: a place on the floor is refused until one is of now",
    "telepresence/teleop/invitations.py": "links end at a date; a clock that is set makes them end sooner or later",
    "catkin_ws/src/pilot_page/src/pilot_page/health.py": "a report that is not of now is not shown",
    "gui/app/invite_dialog.py": "how long a link lasts, which is shown and nothing else",
    "gui/app/capture.py": "the name of a snapshot whose picture has no date",
    "telepresence/video/images.py": "an old picture is not the first that is shown; nor is one after a jump",
    "catkin_ws/src/pepper_sensors_py/nodes/camera.py": "the robot's clock against ours, anew after a jump",
    "catkin_ws/src/naoqi_driver_py/src/naoqi_driver/goal_topic.py": "an old goal is refused, none of now after a jump",
    "catkin_ws/src/rto_node/src/rto_node/webrtc_camera.py": "the age of a picture; what is not plausible is unknown",
    "catkin_ws/src/telepresence_ros/src/telepresence_ros/robot_state.py": "begins again when time does",
    "pepper_sim/naoqi/people/targets.py": "what an event says of a target; one that is not of now is none",
    "pepper_sim/services/al_user_session.py": "when somebody was there last; users are forgotten sooner or later",
    "pepper_sim/services/al_world_representation.py": "where things were so many seconds ago; they seem older or newer",
    "pepper_sim/naoqi/audio/microphones.py": "a stamp, of when the sound began",
    "catkin_ws/src/sim_bringup/src/sim_bringup/picture_topics.py": "pictures from before a reset, for 3 s",
}
_ORDER = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)


def dated(tree: ast.AST) -> list[int]:
    """Return the lines where a date, or a name that was given one, is subtracted from, added to or compared."""
    names: set[str] = set()
    for node in ast.walk(tree):
        for target in node.targets if isinstance(node, ast.Assign) else ():
            pairs = [(target, node.value)]
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(target.elts, node.value.elts, strict=True))
            names |= {ast.unparse(name) for name, value in pairs if any(map(is_date, outside_calls(value)))}

    def is_dated(expression: ast.AST) -> bool:
        return any(is_date(part) or ast.unparse(part) in names for part in ast.walk(expression) if is_name(part))

    found = []
    for node in ast.walk(tree):
        summed = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub | ast.Add)
        compared = isinstance(node, ast.Compare) and any(isinstance(sign, _ORDER) for sign in node.ops)
        if (summed or compared) and is_dated(node):
            found.append(node.lineno)
    return found


def outside_calls(node: ast.AST) -> Iterator[ast.AST]:
    """The parts of an expression, but for what is handed to a function: its answer is no date."""
    yield node
    if not isinstance(node, ast.Call):
        for part in ast.iter_child_nodes(node):
            yield from outside_calls(part)


def is_name(node: ast.AST) -> bool:
    return isinstance(node, ast.Call | ast.Name | ast.Attribute)


def is_date(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and ast.unparse(node.func) in DATES


def programs() -> list[Path]:
    """Every file of Python, those without an ending too, but for tests and what runs on Pepper's own Python 2.7."""
    found = []
    for folder in FOLDERS:
        for path in (ROOT / folder).rglob("*"):
            words = path.relative_to(ROOT).parts
            if not path.is_file() or path.is_symlink() or {"test", "robot"} & {*words} or "." in path.name[:1]:
                continue
            if path.suffix == ".py" or (not path.suffix and path.read_bytes().startswith(b"#!/usr/bin/env python3")):
                found.append(path)
    return found


def test_dates_are_found():
    code = "import time\nbegin = time.time()\nwork()\nif time.monotonic() > 3:\n    print(begin)\nwait(begin + 3)\n"
    assert dated(ast.parse(code)) == [6]
    assert dated(ast.parse("self.due = rospy.Time.now()\nif self.due < x:\n    pass")) == [2]


def test_no_program_waits_by_the_date():
    found = {}
    for path in programs():
        source = path.read_text(encoding="utf-8")
        if any(word in source for word in DATES) and (lines := dated(ast.parse(source))):
            found[str(path.relative_to(ROOT))] = lines
    assert len(programs()) > 300
    assert not found.keys() - COMPARED.keys(), "use time.monotonic(), or say above what happens when the clock is set"
    assert not COMPARED.keys() - found.keys(), "no longer asks for the date"
