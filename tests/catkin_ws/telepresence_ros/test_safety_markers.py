"""What RViz is shown of a decision, and the configuration that shows it."""

import math
from pathlib import Path

import numpy as np
import pytest
import rospy
import yaml
from telepresence_ros.safety_markers import RED, RING_GAP, RING_LEAST, RING_WIDTH, STATE_COLOURS, draw
from telepresence_ros.safety_topics import to_message
from visualization_msgs.msg import Marker

from telepresence.safety import PEPPER, ROBOTINO, SECTORS, Decision, State

STAMP = rospy.Time(12, 0)
CONFIG = Path(__file__).resolve().parents[3] / "catkin_ws/src/rto_safe_teleop/config/safety.rviz"


def decision(**changes):
    allowed = np.full(SECTORS, ROBOTINO.limits.max_speed)
    allowed[18] = 0.0
    usual = dict(vx=0.1, vy=0.0, wz=0.0, state=State.LIMITED, reason="Slowed.", allowed=allowed)
    return Decision(**{**usual, **changes})


def drawn(made, profile=ROBOTINO, obstacles=((0.5, 0.1),)):
    markers = draw(profile, made, np.array(obstacles).reshape(-1, 2), "base_link", STAMP).markers
    assert [m.id for m in markers] == [0, 1, 2, 3, 4]
    assert {(m.header.frame_id, m.header.stamp, m.ns) for m in markers} == {("base_link", STAMP, "safety")}
    return markers


def colour(rgba):
    return rgba.r, rgba.g, rgba.b, rgba.a


def test_outline_is_closed_and_that_of_the_robot():
    for profile in (ROBOTINO, PEPPER):
        rim = drawn(decision(), profile)[0].points
        assert (rim[0].x, rim[0].y) == pytest.approx((rim[-1].x, rim[-1].y), abs=1e-9)
        assert profile.outline.measure(np.array([(p.x, p.y) for p in rim]))[0] == pytest.approx(0.0, abs=1e-3)


def test_ring_is_as_long_and_green_as_the_speed_that_is_allowed():
    ring = drawn(decision(sector=0))[1]
    assert ring.type == Marker.TRIANGLE_LIST
    assert len(ring.points) == len(ring.colors) == 6 * SECTORS
    inner = ROBOTINO.outline.outer_radius + RING_GAP
    reach = [max(math.hypot(p.x, p.y) for p in ring.points[6 * k : 6 * k + 6]) for k in range(SECTORS)]
    assert reach[18] == pytest.approx(inner + RING_LEAST)
    assert reach[36] == pytest.approx(inner + RING_WIDTH)
    left = [math.degrees(math.atan2(p.y, p.x)) for p in ring.points[6 * 18 : 6 * 18 + 6]]
    assert (min(left), max(left)) == pytest.approx((87.5, 92.5))
    red, green = ring.colors[6 * 18], ring.colors[6 * 36]
    assert red.r > red.g and green.g > green.r
    assert colour(ring.colors[0]) == (1.0, 1.0, 1.0, 1.0)  # the sector of what limits most


def test_dots_arrow_and_words():
    _, _, dots, arrow, text = drawn(decision())
    assert [(p.x, p.y) for p in dots.points] == [(0.5, 0.1)]
    assert arrow.points[1].x == pytest.approx(0.1)
    assert text.text == "limited\nSlowed."
    assert colour(text.color) == STATE_COLOURS[State.LIMITED]
    assert colour(drawn(decision(state=State.FAULT))[4].color) == RED


def test_what_is_gone_is_taken_away():
    _, _, dots, arrow, _ = drawn(decision(vx=0.0), obstacles=())
    assert (dots.action, arrow.action) == (Marker.DELETE, Marker.DELETE)


def test_a_layer_that_knows_no_speeds_is_drawn_all_the_same():
    assert len(drawn(decision(allowed=np.full(SECTORS, math.nan)))[1].points) == 6 * SECTORS


def test_message_carries_the_decision():
    message = to_message(decision(sector=None, gap=0.25, command_age=0.1, scanning=True))
    assert (message.state, message.reason, message.sector, message.gap) == ("limited", "Slowed.", -1, 0.25)
    assert (message.vx, message.command_age, message.scanning) == (0.1, 0.1, True)
    assert len(message.allowed) == SECTORS and message.allowed[18] == 0.0


def test_the_configuration_shows_both_robots():
    displays = yaml.safe_load(CONFIG.read_text())["Visualization Manager"]["Displays"]
    topics = {d.get("Marker Topic", d.get("Topic")): d["Class"] for d in displays}
    assert topics["/rto3/safety_markers"] == topics["/safety_markers"] == "rviz/MarkerArray"
    assert topics["/rto3/distance_sensors_scan"] == "rviz/LaserScan"
