"""The whole window with a robot that runs already, and one that the window starts."""

import signal
import subprocess
import time

import pytest
from private_master import start_master

from telepresence.station import processes
from telepresence.station.fault_sentences import NOTICED, Cause
from telepresence.station.ros_master import master_proxy

pytestmark = [pytest.mark.ros, pytest.mark.x11]

QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
READY = "a key holds until the next one"
DRIVEN, ZERO = (0.2, 0.0, 0.0), (0.0, 0.0, 0.0)


@pytest.fixture
def robot(ros_master, start_robot):
    return start_robot()


def open_attached(screen, wait_until, *arguments):
    window = screen.open_window(*arguments)
    wait_until(lambda: READY in window.terminal_text(), "the keyboard runs in the terminal")
    window.enter_terminal()
    return window


def commands(robot):
    """What the robot has heard: vx, vy [m/s], wz [rad/s] of each."""
    return [heard[1:] for heard in robot.heard]


def halves(place):
    """A point in the left and one in the right half of the picture."""
    x, y = place("video")
    return (x - 150, y), (x + 150, y)


def shows_picture(screen, place):
    (red, _, _), (_, _, blue) = (screen.colour(*point) for point in halves(place))
    return red > 200 and blue > 200


def test_the_drive_pad_takes_over_and_drives_while_a_key_is_held(screen, wait_until, place, robot):
    window = open_attached(screen, wait_until)
    wait_until(lambda: shows_picture(screen, place), "the picture is on the screen")
    window.type_until("j", lambda: robot.velocity() == (0.0, 0.0, 0.5), "a key in the terminal turns the robot")

    window.click(place("video"))
    screen.do("mousemove", *place("terminalFrame"))
    screen.do("keydown", "w")
    wait_until(lambda: "Another input drives now" in window.terminal_text(), "the terminal's keyboard lets go")
    robot.heard.clear()
    wait_until(lambda: commands(robot)[-10:] == [DRIVEN] * 10, "the robot hears the pad")
    assert {*commands(robot)} <= {DRIVEN, ZERO}, "a picture that is late, from a busy machine, stops for a moment"
    robot.heard.clear()
    screen.do("keyup", "w")
    wait_until(lambda: ZERO in commands(robot), "the release stops")
    wait_until(lambda: time.monotonic() > robot.heard[-1][0] + 0.5, "nobody drives any more")
    heard = commands(robot)
    assert {*heard[heard.index(ZERO) :]} == {ZERO}

    screen.do("keydown", "q")
    wait_until(lambda: robot.velocity() == (0.0, 0.0, 0.5), "the robot turns")
    window.click(place("terminalFrame"))
    wait_until(lambda: robot.velocity() == (0.0, 0.0, 0.0), "a click into the terminal stops the pad")
    screen.do("keyup", "q")


def test_stop_ends_the_session_in_the_terminal(screen, wait_until, place, robot, ros_environment):
    window = open_attached(screen, wait_until, "--tell")
    window.type_until("i", lambda: robot.velocity() == DRIVEN, "the robot drives")
    window.click(place("stopButton"))
    wait_until(lambda: robot.velocity() == (0.0, 0.0, 0.0), "the robot stands")
    wait_until(lambda: window.terminal_text().rstrip().endswith("$"), "the terminal is at the prompt")
    wait_until(lambda: "programs run elsewhere and go on" in window.output, "it says what still runs")
    window.click(place("sessionButton"))
    wait_until(lambda: not window.terminal_text().rstrip().endswith("$"), "the keyboard is started again")
    assert not window.terminal_has_keyboard(), "a button leaves the keys to the pad"
    screen.do("keydown", "q")
    wait_until(lambda: robot.velocity() == (0.0, 0.0, 0.5), "whose key drives")
    screen.do("keyup", "q")

    processes.send(robot.process.pid, signal.SIGKILL)
    robot.process.wait()
    master = master_proxy(ros_environment["ROS_MASTER_URI"], 5.0)
    assert master.lookupNode("/test", "/fake_robot")[0] == 1, "the master has not noticed"
    window.click(place("stopButton"))
    wait_until(lambda: "Stopped: the robot's programs have ended" in window.output, "the window knows", timeout=45.0)
    wait_until(lambda: master.lookupNode("/test", "/fake_robot")[0] != 1, "the master has forgotten it")


def test_a_second_window_beside_the_first_has_a_keyboard_of_its_own(screen, wait_until, place, robot, ros_environment):
    open_attached(screen, wait_until)
    window = open_attached(screen, wait_until)
    window.click(place("terminalFrame"))  # which lies on that of the first
    window.type_until("j", lambda: robot.velocity() == (0.0, 0.0, 0.5), "its keys drive")
    master = master_proxy(ros_environment["ROS_MASTER_URI"], 5.0)
    for name in ("/teleop_twist_keyboard", "/teleop_twist_keyboard_2"):
        code, _, address = master.lookupNode("/test", name)
        assert code == 1 and master_proxy(address, 5.0).getPid("/test")[0] == 1, name


def test_killing_the_window_leaves_no_program_and_no_command(screen, wait_until, robot):
    window = open_attached(screen, wait_until)
    window.type_until("i", lambda: robot.velocity() == DRIVEN, "the robot drives")
    before = window.family()
    processes.send(window.process.pid, signal.SIGKILL)
    window.process.wait(10)
    left = lambda: [pid for pid in before if pid in processes.descendants()]  # noqa: E731
    wait_until(lambda: not left(), "every process of the window has ended")
    wait_until(lambda: time.monotonic() - robot.heard[-1][0] > 1.0, "nobody drives any more", timeout=5.0)


def test_pictures_come_back_after_a_restart_of_master_and_robot(
    screen, wait_until, place, ros_environment, run_program, start_robot
):
    uri = ros_environment["ROS_MASTER_URI"]
    master = start_master(uri, run_program, wait_until)
    robot = start_robot()
    window = open_attached(screen, wait_until, "--tell")
    wait_until(lambda: shows_picture(screen, place), "the picture is on the screen")

    processes.send(robot.process.pid, signal.SIGSTOP)
    wait_until(lambda: NOTICED[Cause.PICTURE] in window.output, "the window says that pictures have stopped")
    for process in (master, robot.process):
        processes.send(process.pid, signal.SIGKILL)
        process.wait()
    wait_until(lambda: NOTICED[Cause.MASTER] in window.output, "the window says what its cause is by now")
    wait_until(lambda: not shows_picture(screen, place), "the picture is greyed")
    start_master(uri, run_program, wait_until)
    start_robot()
    wait_until(lambda: shows_picture(screen, place), "the picture is back")
