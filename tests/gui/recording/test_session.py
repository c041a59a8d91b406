"""A session's figures and its report, from a bag written with rosbag and from numbers."""

import math
import re
import subprocess
import sys
import textwrap
from html.parser import HTMLParser

import numpy as np
import pytest

from gui.recording.report_plots import nice_step, path_plot, time_plot
from gui.recording.session import Session
from gui.recording.session_report import HALTS, main, report


def session(**parts):
    """Ten seconds: 5 s straight ahead at 0.2 m/s, then 2 s before a wall."""
    t = np.arange(0.0, 10.0, 0.05)
    given = np.where(t < 5.0, 0.2, 0.0)
    states = tuple("clear" if at < 5.0 else "blocked" if at < 7.0 else "no command" for at in t)
    values = {
        "start": 1.7e9,
        "duration": 10.0,
        "path": np.stack([t, np.minimum(t, 5.0) * 0.2, 0 * t, 0 * t], axis=1),
        "commands": np.array([(at, 0.2, 0.0, 0.0) for at in t if at < 7.0]),
        "safety": np.stack([t, given, 0 * t, 0 * t, 2.0 - np.minimum(t, 5.0) * 0.36], axis=1),
        "states": states,
        "reasons": tuple(f"because of <{state}>" for state in states),
        "pictures": np.stack([t[::2], np.full(len(t[::2]), 0.04)], axis=1),
        "battery": np.array([(0.0, 0.9, 25.0), (9.0, 0.88, 25.0)]),
        "messages": 800,
    } | parts
    return Session(**values)


def test_figures_of_a_session():
    one = session()
    assert one.distance() == pytest.approx(1.0, abs=0.02)
    assert one.top_speed() == pytest.approx(0.2)
    assert one.nearest() == pytest.approx(0.2)
    assert one.passed() == pytest.approx(5.0 / 7.0, abs=0.05)
    assert one.time_in_states() == pytest.approx({"clear": 5.0, "blocked": 2.0, "no command": 3.0}, abs=0.1)
    assert one.picture_rate()[3, 1] == pytest.approx(10, abs=1)


def test_a_stop_is_told_once_with_its_reason_and_length():
    (stop,) = session().stops(HALTS)
    assert (stop.state, stop.reason) == ("blocked", "because of <blocked>")
    assert (stop.start, stop.duration) == pytest.approx((5.0, 2.0), abs=0.1)


def test_an_empty_session_has_a_report_too():
    empty = session(
        path=np.empty((0, 4)), commands=np.empty((0, 4)), safety=np.empty((0, 5)), states=(), reasons=(),
        pictures=np.empty((0, 2)), battery=np.empty((0, 3)),
    )  # fmt: skip
    assert math.isnan(empty.passed()) and empty.distance() == 0.0
    assert "no odometry" in report(empty, "empty.bag")


def test_the_report_stands_alone_and_escapes_what_it_quotes():
    page = report(session(), "a<b>.bag")
    assert "http" not in page and "src=" not in page and "<script" not in page
    assert "a&lt;b&gt;.bag" in page and "because of &lt;blocked&gt;" in page
    assert page.count("<svg") == page.count("</svg>") == 5
    HTMLParser(convert_charrefs=True).feed(page)
    assert "nan" not in re.sub(r"<title>.*?</title>", "", page)


def test_plots_put_high_values_up_and_early_ones_left():
    plot = time_plot([("a", "given", np.array([(0.0, 0.0), (10.0, 1.0)]))], "m", 10.0)
    (x0, y0), (x1, y1) = (map(float, pair.split(",")) for pair in re.search('points="([^"]+)"', plot)[1].split())
    assert x0 < x1 and y0 > y1


def test_the_path_is_drawn_with_x_to_the_right_and_y_up():
    plot = path_plot(np.array([(0, 0, 0, 0), (1, 1.0, 0, 0), (2, 1.0, 1.0, 0)], float))
    points = [tuple(map(float, pair.split(","))) for pair in re.search('points="([^"]+)"', plot)[1].split()]
    assert points[1][0] > points[0][0] and points[2][1] < points[1][1]


@pytest.mark.parametrize(("span", "step"), [(1.0, 0.2), (7.0, 2.0), (0.03, 0.01), (0.0, 1.0)])
def test_steps_of_a_scale_are_round(span, step):
    assert nice_step(span) == pytest.approx(step)


WRITE_BAG = textwrap.dedent("""
    import sys, rosbag, rospy
    from geometry_msgs.msg import Twist
    from nav_msgs.msg import Odometry
    from telepresence_msgs.msg import SafetyState
    with rosbag.Bag(sys.argv[1], "w") as bag:
        for number in range(100):
            stamp = rospy.Time(100.0 + 0.05 * number)
            odometry = Odometry()
            odometry.pose.pose.position.x, odometry.pose.pose.orientation.w = 0.01 * number, 1.0
            bag.write("/rto3/odom", odometry, stamp)
            twist = Twist()
            twist.linear.x = 0.2
            bag.write("/rto3/safe_cmd_vel", twist, stamp)
            bag.write("/rto3/cmd_vel", Twist(), stamp)
            bag.write("/rto3/safety", SafetyState(state="limited", reason="slow", vx=0.1, gap=0.5), stamp)
""")


def test_a_bag_becomes_a_page_beside_it(tmp_path):
    bag = tmp_path / "drive.bag"
    subprocess.run([sys.executable, "-c", WRITE_BAG, str(bag)], check=True, timeout=60)
    done = subprocess.run(
        [sys.executable, "-m", "gui.session_report", str(bag)], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "drive.html").read_text()
    assert "<b>0.99 m</b>" in page and "<b>50 %</b>" in page and "limited" in page


@pytest.mark.parametrize("content", [b"", b"this is no bag"])
def test_what_is_no_bag_is_refused_in_words(tmp_path, capsys, content):
    path = tmp_path / "broken.bag"
    path.write_bytes(content)
    assert main([str(path)]) == 1
    said = capsys.readouterr().err
    assert "broken.bag" in said and "Traceback" not in said
