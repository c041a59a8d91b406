"""The report's command lines, typed beside a simulated Pepper; docs/guides.md says what they print."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest
from guide_lines import GuideLine, tables, typed

pytestmark = pytest.mark.ros

AT_ONCE = 3
OPTIONS = {"rob_cam.py": "_port:=0", "teleop_twist_keyboard teleop": "__name:=another"}
"""Word of a line -> what keeps it out of the others' way."""


def test_the_reports_lines_print_what_the_page_of_the_guides_says(graph):
    graph.start_robot()
    library = graph.workspace / "lib" / "telepresence_1"
    page = graph.run(str(library / "com_cam.py"), "_source:=test", f"_nao_port:={graph.robot_port}", "_port:=0")
    page.wait_for("the page is at ")

    def type_it(line: GuideLine) -> None:
        robot = "127.0.0.1" if "ROBOT_PORT" in line.line else f"127.0.0.1:{graph.robot_port}"
        more = " ".join(option for word, option in OPTIONS.items() if word in line.line)
        with typed(line, graph.environment, more, ROBOT_IP=robot, ROBOT_PORT=str(graph.robot_port)):
            pass

    with ThreadPoolExecutor(AT_ONCE) as hands:
        list(hands.map(type_it, tables()["The report: beside the robot"]))
