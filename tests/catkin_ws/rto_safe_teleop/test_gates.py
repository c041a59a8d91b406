"""The guide's bubble to the letter, and the gate as this node uses it. Times are invented."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rto_safe_teleop.gates import BubbleGate, RobotGate

FREE = [0.41] * 9
speeds = st.floats(-0.3, 0.3)


def guide(ranges, velocity, radius=0.4):
    """The rule as the guide gives it, written down once more."""

    def axis(value, most, least):
        if abs(value) > most:
            return math.copysign(most, value)
        return math.copysign(least, value) if 0.0 < abs(value) < least else value

    vx, vy, wz = (axis(velocity[0], 0.2, 0.05), axis(velocity[1], 0.2, 0.05), axis(velocity[2], 1.0, 0.1))
    points = [((d + 0.2) * math.cos(0.698 * i), (d + 0.2) * math.sin(0.698 * i)) for i, d in enumerate(ranges)]
    breach = any(x * x + y * y <= radius**2 for x, y in points)
    predicted = any((x - 0.8 * vx) ** 2 + (y - 0.8 * vy) ** 2 <= radius**2 for x, y in points)
    return (0.0, 0.0, wz) if breach and predicted else (vx, vy, wz)


@given(st.lists(st.floats(0.04, 0.41), min_size=9, max_size=9), speeds, speeds, st.floats(-1.5, 1.5))
def test_bubble_is_the_guides_rule(ranges, vx, vy, wz):
    gate = BubbleGate()
    gate.receive_ranges(ranges, 0.0)
    assert gate.receive_command(vx, vy, wz, 0.0).velocity == guide(ranges, (vx, vy, wz))


def test_bubble_logs_what_the_guides_node_logs():
    gate = BubbleGate()
    assert gate.log_lines() == ""
    gate.receive_ranges([0.15, *FREE[1:]], 0.0)
    gate.receive_command(0.2, 0.0, 0.0, 0.0)
    assert gate.log_lines() == "SafetyBreach: 1\nSafeToNavigate: 0"
    gate.receive_command(-0.2, 0.0, 0.0, 0.1)
    assert gate.log_lines() == "SafetyBreach: 1\nSafeToNavigate: 1"
    gate.receive_ranges(FREE, 0.2)
    gate.receive_command(0.2, 0.0, 0.0, 0.2)
    assert gate.log_lines() == "SafetyBreach: 0\nSafeToNavigate: 1"


def test_bubble_sends_nothing_before_the_first_reading():
    assert BubbleGate().receive_command(0.1, 0.0, 0.0, 0.0).velocity is None


def test_bubble_acts_only_when_a_command_comes():
    gate = BubbleGate()
    gate.receive_ranges(FREE, 0.0)
    gate.receive_command(0.1, 0.0, 0.0, 0.0)
    assert gate.tick(100.0) is None


def test_f11_a_lost_link_leaves_the_bubbles_last_velocity_standing():
    gate = BubbleGate()
    gate.receive_ranges(FREE, 0.0)
    assert gate.receive_command(0.2, 0.0, 0.0, 0.0).velocity == (0.2, 0.0, 0.0)
    assert all(gate.tick(0.05 * tick) is None for tick in range(1, 200))  # nothing makes the robot stop


@pytest.mark.parametrize(("gate", "stops"), [(BubbleGate, False), (RobotGate, True)])
def test_f12_a_pilot_that_sends_nothing_on_release_is_stopped_by_the_gate_only(gate, stops):
    driven = Driven()
    driven.gate = gate()
    driven.run(0.1)
    key_press = (0.2, 0.0, 0.0)  # the guide's window sends once, when the key goes down
    sent = [driven.gate.receive_command(*key_press, driven.now)]
    for _ in range(20):
        driven.run(0.05)
        sent.append(driven.answer)
    velocities = [answer.velocity for answer in sent if answer is not None and answer.velocity is not None]
    assert velocities
    assert (velocities[-1] == (0.0, 0.0, 0.0)) == stops


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, math.inf])
def test_bubble_needs_a_radius(radius):
    with pytest.raises(ValueError, match="radius"):
        BubbleGate(radius)


class Driven:
    """A gate that is fed as the node feeds it, 20 times a second, from a robot that follows at once; what the first
    beam sees comes nearer as it drives."""

    def __init__(self, ranges=FREE):
        self.gate = RobotGate()
        self.now = 0.0
        self.x = 0.0
        self.ranges = list(ranges)
        self.bumper = True
        self.answer = None

    def run(self, seconds, command=None):
        for _ in range(round(seconds / 0.05)):
            self.now += 0.05
            ahead = self.ranges[0] if self.ranges[0] >= FREE[0] else max(0.04, self.ranges[0] - self.x)
            self.gate.receive_ranges([ahead, *self.ranges[1:]], self.now)
            self.gate.receive_odometry(self.x, 0.0, 0.0, self.now)
            if self.bumper:
                self.gate.receive_bumper(False, self.now)
            if command is not None:
                self.gate.receive_command(*command, self.now)
            self.answer = self.gate.tick(self.now)
            if self.answer is not None and self.answer.velocity is not None:
                self.x += self.answer.velocity[0] * 0.05
        return self.answer


def test_gate_lets_a_free_robot_drive():
    driven = Driven()
    driven.run(0.5)
    assert driven.answer.velocity is None  # nobody has commanded anything: others may drive
    driven.run(2.0, (0.2, 0.0, 0.0))
    assert driven.answer.velocity[0] == pytest.approx(0.2, abs=0.02)


def test_gate_does_not_drive_into_what_it_sees():
    driven = Driven([0.08, *FREE[1:]])
    driven.run(0.5)
    driven.run(1.0, (0.2, 0.0, 0.0))
    assert driven.answer.velocity[0] < 0.1
    assert driven.answer.state in ("limited", "blocked")


def test_gate_stops_when_commands_cease_and_then_is_silent():
    driven = Driven()
    driven.run(1.0, (0.2, 0.0, 0.0))
    driven.run(0.4)
    assert driven.answer.velocity == (0.0, 0.0, 0.0)
    driven.run(0.3)
    assert driven.answer.velocity is None


def test_gate_stops_without_readings():
    driven = Driven()
    driven.run(1.0, (0.2, 0.0, 0.0))
    for _ in range(20):
        driven.now += 0.05
        driven.gate.receive_odometry(driven.x, 0.0, 0.0, driven.now)
        driven.gate.receive_bumper(False, driven.now)
        driven.gate.receive_command(0.2, 0.0, 0.0, driven.now)
        answer = driven.gate.tick(driven.now)
    assert answer.velocity == (0.0, 0.0, 0.0) and answer.state == "sensor stale"


def test_gate_stops_at_once_when_the_program_with_the_odometry_has_ended_and_drives_with_the_next():
    driven = Driven()
    driven.run(1.0, (0.2, 0.0, 0.0))
    driven.gate.lose_odometry()
    answer = driven.gate.tick(driven.now + 0.05)
    assert answer.velocity == (0.0, 0.0, 0.0) and answer.state == "fault"
    driven.run(1.0, (0.2, 0.0, 0.0))
    assert driven.answer.velocity[0] > 0.1


def test_gate_stops_without_the_bumper_and_drives_when_it_is_back():
    driven = Driven()
    driven.run(1.0, (0.2, 0.0, 0.0))
    driven.bumper = False
    driven.run(0.4, (0.2, 0.0, 0.0))
    assert driven.answer.velocity[0] > 0.1
    driven.run(0.2, (0.2, 0.0, 0.0))
    assert driven.answer.velocity == (0.0, 0.0, 0.0) and driven.answer.state == "sensor stale"
    assert driven.answer.reason.startswith("The bumper is silent for 0.")
    driven.bumper = True
    driven.run(1.0, (0.2, 0.0, 0.0))
    assert driven.answer.velocity[0] > 0.1


@pytest.mark.parametrize(("has_bumper", "drives"), [(True, False), (False, True)])
def test_gate_that_was_never_given_a_bumper_drives_only_a_robot_that_has_none(has_bumper, drives):
    driven = Driven()
    driven.gate, driven.bumper = RobotGate(has_bumper), False
    driven.run(2.0, (0.2, 0.0, 0.0))
    assert (driven.answer.velocity[0] > 0.1) == drives
    assert ("The bumper has sent nothing yet." in driven.answer.reason) != drives


def test_gate_stops_on_the_bumper():
    driven = Driven()
    driven.run(1.0, (0.2, 0.0, 0.0))
    driven.gate.receive_bumper(True, driven.now)
    driven.run(0.1, (0.2, 0.0, 0.0))
    assert driven.answer.velocity[0] <= 0.0
