"""A browser as a window of a real drive_lease, in one program. Both clocks are invented."""

import time

import numpy as np
import pytest

from telepresence.page.browser_window import MOST_PER_SECOND, SILENCE, STOP_KEPT, BrowserWindow
from telepresence.page.commands import AskMessage, DriveMessage, FloorMessage, LookMessage
from telepresence.teleop import lease_client
from telepresence.teleop.drive_lease import LATE, DriveLease
from telepresence.teleop.lease_messages import PILOT, WATCHER, Account, Reply, sign_joined
from telepresence.teleop.lease_topics import Asked, Joined, LeaseState
from telepresence.teleop.lease_windows import LEASE
from telepresence.teleop.looking import Look, Manner
from telepresence.teleop.robot_readings import BodyState, CameraView, Lens

FORWARD = (0.2, 0.0, 0.0)
ZERO = (0.0, 0.0, 0.0)


class Answer:
    def __init__(self, ok, text, value):
        self.ok, self.text, self.value = ok, text, value


class Robot:
    """drive_lease, and what it gave the robot. It is the link of all windows, too."""

    def __init__(self, monkeypatch):
        self.now = 1000.0
        self.epoch = 0
        self.restart()
        self.given = []
        self.looks = []
        self.windows = []
        self.held_up = None
        """What waits for an answer to joining; None while all are answered at once."""
        self.on_the_way = None
        """Requests that drive_lease has not received yet; None while they come at once."""
        monkeypatch.setattr(lease_client.time, "monotonic", lambda: self.now)

    def restart(self):
        """Another drive_lease takes the place of the one that was killed."""
        self.epoch += 1
        self.lease = DriveLease(lambda name: Account(name, WATCHER if name == "will" else PILOT))

    def open(self, name):
        self.node_name = f"/pilot_page/{name}"
        said = []
        account = Account(name, WATCHER if name == "will" else PILOT)
        window = BrowserWindow(Link(self, self.node_name), account, said.append, Floor(self))
        window.said = said
        self.windows.append(window)
        self.tell()
        return window

    def tell(self):
        state = self.lease.state(self.now)
        message = LeaseState(
            str(self.epoch), False, state.pilot, state.window, state.asking, state.stopped_by, state.hold, state.other,
            state.velocity, tuple(zip(state.present, state.windows, strict=True)), self.now,
        )  # fmt: skip
        for window in self.windows:
            window.receive(message)

    def give(self, velocity):
        if velocity is not None:
            self.given.append(tuple(velocity))

    def go_on(self):
        held_up, self.held_up = self.held_up, None
        for join in held_up:
            join()

    def take(self, name, clock=0.0):
        """A browser that has the robot, and its hand."""
        window = self.open(name)
        hand = Hand(self, window, clock)
        hand.send(None)
        self.pass_time(0.05)
        assert window.mine and window.obstacle() == ""
        return window, hand

    def pass_time(self, seconds):
        for _ in range(round(seconds / 0.05)):
            self.now += 0.05
            self.give(self.lease.tick(self.now))
            for window in self.windows:
                window.check(self.now)
        self.tell()


class Floor:
    """A camera that looks straight down from 2 m, 1 m ahead of the robot: the floor there is what it shows."""

    farthest, radius, top_speed, top_turn, safety = 3.0, 0.3, 0.35, 1.0, None

    def __init__(self, robot):
        self.robot = robot

    @property
    def body(self):
        return BodyState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, "odom", self.robot.now)

    def newest(self):
        return time.time()

    def view(self, stamp):
        down = np.array(((0.0, -1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
        return CameraView(Lens(100.0, 100.0, 50.0, 50.0, 100, 100), down, np.array((1.0, 0.0, 2.0)))


class Link:
    def __init__(self, robot, node_name):
        self.robot, self.node_name = robot, node_name

    def send(self, session, command):
        self.robot.give(self.robot.lease.receive(session, command, self.robot.now))

    def send_look(self, session, command):
        self.robot.looks.append(self.robot.lease.look(session, command, self.robot.now))

    def join(self, claim, session, proof, then):
        robot = self.robot
        if robot.held_up is not None:
            robot.held_up.append(lambda: self.join(claim, session, proof, then))
            return
        if not session:
            offer = robot.lease.offer(claim, robot.now)
            then(Answer(True, "", Joined(offer.session, offer.key, b"")))
            return
        window = robot.lease.prove(claim, session, proof, robot.now)
        reply = window if isinstance(window, Reply) else robot.lease.admit(window, robot.now)
        then(Answer(reply.ok, reply.reason, Joined("", b"", sign_joined(window.key))))
        robot.tell()

    def ask(self, session, number, action, to, proof, then):
        robot = self.robot
        if robot.on_the_way is not None:
            robot.on_the_way.append((action, lambda: self._ask(session, number, action, to, proof, then)))
        else:
            self._ask(session, number, action, to, proof, then)

    def _ask(self, session, number, action, to, proof, then):
        robot = self.robot
        reply = robot.lease.ask(session, number, action, to, proof, robot.now)
        then(Answer(reply.ok, reply.reason, Asked(reply.ended, robot.lease.sign(session, number, reply))))
        robot.tell()


@pytest.fixture
def robot(monkeypatch):
    return Robot(monkeypatch)


class Hand:
    """A page that sends, with a clock of its own."""

    def __init__(self, robot, window, clock):
        self.robot, self.window, self.clock = robot, window, clock
        self.number = 0

    def send(self, velocity, late=0.0, hold=""):
        self.number += 1
        sent = self.robot.now + self.clock - late
        return self.window.drive(DriveMessage(self.number, sent, velocity, hold), self.robot.now)

    def point(self, late=0.0, press=1):
        self.number += 1
        sent = self.robot.now + self.clock - late
        return self.window.point(FloorMessage(self.number, sent, (0.5, 0.5), press, None, 0.2, ""), self.robot.now)


@pytest.mark.parametrize("clock", [0.0, -999.0, 86400.0, -86400.0])
def test_it_drives_whatever_the_browser_s_clock_says(robot, clock):
    _, hand = robot.take("anna", clock)
    assert hand.send(FORWARD) and robot.given[-1] == FORWARD
    robot.pass_time(0.1)
    hand.send(ZERO)
    assert robot.given[-1] == ZERO


def test_a_late_command_moves_nothing(robot):
    _, hand = robot.take("anna", -999.0)
    robot.given.clear()
    hand.send(FORWARD, late=LATE + 0.05)
    assert FORWARD not in robot.given
    hand.send(FORWARD, late=LATE - 0.05)
    assert robot.given[-1] == FORWARD


def test_a_silent_browser_stops_before_the_lease_has_to(robot):
    _, hand = robot.take("anna", 5.0)
    hand.send(FORWARD)
    robot.pass_time(SILENCE - 0.05)
    assert robot.given[-1] == FORWARD
    robot.given.clear()
    robot.pass_time(0.1)
    assert robot.given[0] == ZERO and set(robot.given) == {ZERO}
    hand.send(FORWARD)
    assert robot.given[-1] == FORWARD, "it may go on"


def test_repeated_old_and_too_many_messages_are_not_passed_on(robot):
    window = robot.open("anna")
    assert window.drive(DriveMessage(5, 1.0, FORWARD, ""), robot.now)
    for number in (5, 4, 1):
        assert not window.drive(DriveMessage(number, 1.0, FORWARD, ""), robot.now)
    passed = [window.drive(DriveMessage(10 + count, 1.0, FORWARD, ""), robot.now) for count in range(100)]
    assert sum(passed) <= MOST_PER_SECOND and window.refused >= 63
    robot.now += 1.0
    assert window.drive(DriveMessage(200, 2.0, FORWARD, ""), robot.now)


def test_a_watcher_s_commands_end_here_where_the_lease_takes_everybody_for_a_pilot(robot):
    robot.lease = DriveLease(lambda name: Account(name, PILOT))  # names are not checked there
    watcher = robot.open("will")
    hand = Hand(robot, watcher, 3.0)
    hand.send(FORWARD)
    watcher.ask(AskMessage(1, "take", None))
    robot.pass_time(0.05)
    robot.lease._take(next(iter(robot.lease._windows)), robot.now)  # and had it the robot
    robot.tell()
    assert watcher.mine
    for _ in range(3):
        hand.send(FORWARD)
        robot.pass_time(0.05)
    assert FORWARD not in robot.given and watcher.refused > 3 and "may watch, not drive" in watcher.said[0]


def test_a_watcher_stops_the_robot_and_cannot_drive_it(robot):
    pilot, hand = robot.take("anna")
    watcher = robot.open("will")
    hand.send(FORWARD)
    robot.given.clear()
    hand = Hand(robot, watcher, 3.0)
    hand.send(FORWARD)
    watcher.ask(AskMessage(1, "take", None))
    hand.send(FORWARD)
    assert robot.given == [] and "may watch, not drive" in watcher.obstacle()
    watcher.ask(AskMessage(2, "stop", None))
    robot.pass_time(0.05)
    assert robot.given[-1] == ZERO and "will has pressed the red stop" in pilot.obstacle()


def test_a_red_stop_waits_until_the_window_has_joined(robot):
    _, hand = robot.take("anna")
    hand.send(FORWARD)
    robot.held_up = []
    other = robot.open("ben")
    assert not other.describe()["joined"]
    other.ask(AskMessage(1, "stop", None))
    robot.pass_time(0.1)
    assert not other.describe()["stopped_by"] and other.said == []
    robot.go_on()
    robot.pass_time(0.1)
    assert robot.given[-1] == ZERO and other.describe()["stopped_by"] == "ben"


def test_a_red_stop_is_not_made_long_after_it_was_pressed(robot):
    robot.held_up = []
    window = robot.open("anna")
    window.ask(AskMessage(1, "stop", None))
    robot.pass_time(STOP_KEPT + 0.1)
    assert len(window.said) == 1, "the person learns that it was not"
    robot.go_on()
    robot.pass_time(0.1)
    assert not window.describe()["stopped_by"]


def test_a_reason_not_to_drive_holds_the_robot(robot):
    _, hand = robot.take("anna")
    hand.send(FORWARD)
    hand.send(None, hold="The page is hidden.")
    robot.pass_time(0.05)
    assert robot.given[-1] == ZERO and robot.windows[0].describe()["hold"] == "The page is hidden."
    robot.given.clear()
    hand.send(FORWARD, hold="The page is hidden.")
    assert FORWARD not in robot.given


def test_the_end_of_the_page_s_program_stops_the_robot_at_once(robot):
    _, hand = robot.take("anna")
    hand.send(FORWARD)
    assert robot.lease.lost("/pilot_pag", robot.now) is None and robot.lease.lost("/other", robot.now) is None
    assert tuple(robot.lease.lost("/pilot_page", robot.now)) == ZERO


def test_only_signs_of_life_of_the_page_keep_the_robot(robot):
    window, hand = robot.take("anna")
    robot.pass_time(0.5)
    assert window.mine
    robot.pass_time(1.0)
    robot.pass_time(1.0)
    assert not robot.lease.state(robot.now).pilot, "the program of the page neither renews nor takes by itself"
    hand.send(None)
    robot.pass_time(0.05)
    assert window.mine, "who comes back has it again"


def test_two_browsers_hand_the_robot_over(robot):
    anna, _ = robot.take("anna", 7.0)
    ben = robot.open("ben")
    hand = Hand(robot, ben, -7.0)
    hand.send(None)
    assert not ben.mine
    ben.ask(AskMessage(1, "take", None))
    assert anna.describe()["asking"] == "ben"
    anna.ask(AskMessage(1, "give", None))
    assert ben.mine and anna.describe()["pilot"] == "ben"
    hand.send(FORWARD)
    assert robot.given[-1] == FORWARD


def test_a_look_is_passed_on_once_and_by_the_browsers_clock(robot):
    window, hand = robot.take("anna", clock=500.0)
    look = Look(Manner.GOAL, 0.5, 0.1)
    message = LookMessage(1, robot.now + hand.clock, look)
    window.look(message, robot.now)
    window.look(message, robot.now)
    assert robot.looks == [look]
    robot.pass_time(LATE + 0.1)
    hand.send(None)
    window.look(LookMessage(2, message.sent, look), robot.now)
    assert robot.looks == [look, None]  # it was under way for too long


def test_who_does_not_have_the_robot_turns_nothing(robot):
    robot.take("anna")
    watcher = robot.open("will")
    watcher.look(LookMessage(1, 0.0, Look(Manner.AHEAD)), robot.now)
    assert robot.looks == [] and watcher.refused == 1


def test_a_place_on_the_floor_is_driven_to_like_by_keys(robot):
    window, hand = robot.take("anna", -50.0)
    assert hand.point() and robot.given[-1] == pytest.approx(FORWARD)
    robot.given.clear()
    hand.point(late=LATE + 0.05)
    assert robot.given == [], "a late hand moves nothing"
    hand.number -= 1
    assert not hand.point() and robot.given == [], "nor does a repeated one"
    hand.point()
    robot.pass_time(SILENCE + 0.1)
    assert robot.given[-1] == ZERO, "who is silent stands"
    hand.point()
    assert robot.given[-1] == pytest.approx(FORWARD), "who still holds it drives on, as with a key"
    window.let_go(robot.now)
    assert robot.given[-1] == ZERO and window.describe()["way"] is None
    robot.given.clear()
    hand.point()
    assert not any(any(given) for given in robot.given), "on another connection one presses again"
    hand.point(press=2)
    assert robot.given[-1] == pytest.approx(FORWARD) and window.describe()["way"]
    hand.send(None)
    assert window.describe()["way"] is None


def test_a_watcher_s_hand_on_the_floor_moves_nothing(robot):
    robot.take("anna")
    watcher = robot.open("will")
    robot.given.clear()
    Hand(robot, watcher, 3.0).point()
    assert robot.given == [] and "may watch, not drive" in watcher.said[-1]


def test_who_pressed_in_a_panic_can_stop_again_at_once(robot):
    window, _ = robot.take("anna")
    for number in range(1, 20):
        window.ask(AskMessage(number, "stop", None))
        robot.tell()
    robot.pass_time(0.05)
    window.ask(AskMessage(20, "reset_stop", None))
    robot.tell()
    assert window.describe()["stopped_by"] == ""
    window.ask(AskMessage(21, "stop", None))
    robot.tell()
    assert window.describe()["stopped_by"] == "anna" and window.refused > 10


def test_the_red_stop_ends_the_way_to_a_place(robot):
    _, hand = robot.take("anna")
    hand.point()
    robot.windows[0].ask(AskMessage(1, "stop", None))
    robot.pass_time(0.05)
    robot.windows[0].ask(AskMessage(2, "reset_stop", None))
    robot.tell()
    assert "red stop" in robot.windows[0].said[-1]
    robot.given.clear()
    hand.point()
    assert not any(any(given) for given in robot.given)


def test_a_lease_that_was_lost_and_taken_back_says_why_the_way_to_a_place_has_ended(robot):
    """The page is told of who drives ten times a second: it may never see that nobody did."""
    window, hand = robot.take("anna")
    hand.point()
    robot.pass_time(SILENCE + LEASE + 0.2)
    hand.point()
    robot.tell()
    assert window.mine and window.obstacle() == ""
    robot.given.clear()
    hand.point()
    assert not any(any(given) for given in robot.given)
    assert window.said == ["Nobody drives. Press Take the robot."]
    hand.point(press=2)
    assert robot.given[-1] == pytest.approx(FORWARD)


def test_requests_go_one_after_the_other_and_a_stop_at_once(robot):
    """Each has a thread of its own: on a busy machine the later one would be there first, and the other refused."""
    window, _ = robot.take("anna")
    window.said.clear()
    robot.on_the_way = []

    def arrives():
        action, ask = robot.on_the_way.pop(0)
        ask()
        return action

    for action in ("release", "take", "keep"):
        window.ask(AskMessage(1, action, None))
    assert arrives() == "release"
    assert [action for action, _ in robot.on_the_way] == ["take"]
    window.ask(AskMessage(1, "stop", None))
    assert [action for action, _ in robot.on_the_way] == ["take", "stop"]
    assert [arrives(), arrives(), arrives()] == ["take", "stop", "keep"]
    assert robot.on_the_way == [] and window.said == [] and robot.lease.state(robot.now).stopped_by == "anna"


@pytest.mark.parametrize("joined_before", [False, True])
def test_a_red_stop_that_the_killed_drive_lease_did_not_hear_is_asked_of_the_next(robot, joined_before):
    window, _ = robot.take("anna")
    robot.on_the_way = []
    window.ask(AskMessage(1, "stop", None))
    ((_, arrives),) = robot.on_the_way
    robot.on_the_way = None
    robot.restart()
    if joined_before:
        robot.tell()
        robot.pass_time(1.0)
        assert not robot.lease.state(robot.now).stopped_by
    arrives()
    robot.pass_time(1.0)
    assert robot.lease.state(robot.now).stopped_by == "anna"
