"""The node that decides who drives, on a private graph, with the links of real windows."""

from __future__ import annotations

import re
import signal
import sys

import pytest
from talker import REMOTE_WINDOW, Talker

from telepresence.teleop.accounts import Users

pytestmark = pytest.mark.ros

PASSWORD = "correct horse"
AHEAD = [0.2, 0.0, 0.0]
ZERO = [0.0, 0.0, 0.0]

GATE = """
import rospy
from std_srvs.srv import Trigger, TriggerResponse
rospy.init_node("gate")
answers = iter([TriggerResponse(False, "ben has pressed stop"), TriggerResponse(True, "")])
rospy.Service("reset_stop", Trigger, lambda _request: next(answers))
rospy.Service("stop_drive", Trigger, lambda _request: TriggerResponse(True, ""))
print("ready", flush=True)
rospy.spin()
"""

FORGETFUL_GATE = """
import rospy
from std_srvs.srv import Trigger, TriggerResponse
from telepresence_msgs.msg import SafetyState
rospy.init_node("gate")
message = SafetyState(state="no command")
def stop(_request):
    message.state = "stopped"
    print("asked to stop", flush=True)
    return TriggerResponse(True, "")
def reset(_request):
    message.state = "no command"
    return TriggerResponse(True, "")
rospy.Service("stop_drive", Trigger, stop)
rospy.Service("reset_stop", Trigger, reset)
safety = rospy.Publisher("safety", SafetyState, queue_size=1)
print("ready", flush=True)
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    safety.publish(message)
    rate.sleep()
"""
"""A stop of this one is gone when its program ends, as that of any gate."""

LATE_GATE = """
import signal, threading
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})
import rospy
from std_srvs.srv import Trigger, TriggerResponse
rospy.init_node("gate")
stops = threading.Semaphore(0)
def stop(_request):
    print("asked: stop_drive", flush=True)
    stops.release()
    return TriggerResponse(True, "")
def reset(_request):
    print("asked: reset_stop", flush=True)
    return TriggerResponse(True, "")
print("ready", flush=True)
signal.sigwait({signal.SIGUSR1})
rospy.Service("stop_drive", Trigger, stop)
stops.acquire()
stops.acquire(timeout=1.0)
rospy.Service("reset_stop", Trigger, reset)
rospy.spin()
"""
"""At a signal this one offers its services, the reset after two stops or a second: who waits for that asks last."""


class Remote(Talker):
    """Another window."""

    def __init__(self, graph, accounts, name):
        super().__init__(graph.environment, REMOTE_WINDOW, accounts, name, PASSWORD)

    def state(self, name):
        return self.ask("state")[name]


@pytest.fixture(scope="module")
def accounts(tmp_path_factory):
    users = Users(tmp_path_factory.mktemp("users") / "users.db")
    users.add("anna", PASSWORD, "pilot")
    users.add("will", PASSWORD, "watcher")
    return users.path


def lease_command(graph, accounts):
    return str(graph.workspace / "lib/avatar_gui/drive_lease"), f"_users:={accounts}"


@pytest.fixture(scope="module")
def lease(graph, accounts):
    return graph.run(*lease_command(graph, accounts))


@pytest.fixture(scope="module")
def probe(graph, lease):
    probe = graph.probe()
    probe.watch("/cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"])
    probe.watch("/drive/hold", "std_msgs/String", ["data"])
    return probe


@pytest.fixture(scope="module")
def anna(graph, accounts, probe, wait_until):
    window = Remote(graph, accounts, "anna")
    wait_until(lambda: window.state("mine"), "a free robot is taken")
    yield window
    window.close()


def heard(probe):
    return [fields for _, fields in probe.seen("/cmd_vel")]


def test_the_pilots_velocity_reaches_cmd_vel_and_a_zero_ends_it(anna, probe, wait_until):
    anna.ask("drive", *AHEAD)
    wait_until(lambda: heard(probe)[-5:] == [AHEAD] * 5, "the velocity arrives, repeatedly")
    anna.ask("drive")
    wait_until(lambda: heard(probe)[-1] == ZERO, "silence ends with a zero")


def test_a_watcher_moves_nothing(anna, graph, accounts, probe, wait_until):
    will = Remote(graph, accounts, "will")
    wait_until(lambda: will.state("session"), "the watcher has joined")
    probe.forget("/cmd_vel")
    will.ask("drive", *AHEAD)
    will.ask("ask", "take", "")
    wait_until(lambda: "may watch" in str(will.state("refused")), "the watcher is refused")
    will.ask("steal", anna.state("session"))
    will.ask("ask", "stop", "")
    wait_until(lambda: "not signed by" in str(will.state("refused")), "another's name is of no use")
    assert AHEAD not in heard(probe)
    will.close()


def test_the_red_stop_holds_and_is_told_to_keyboards(anna, probe, wait_until):
    anna.ask("ask", "stop", "")
    wait_until(lambda: anna.state("stopped_by") == "anna", "the stop is latched")
    wait_until(lambda: "red stop" in probe.seen("/drive/hold")[-1][1][0], "keyboards hear why")
    probe.forget("/cmd_vel")
    anna.ask("drive", *AHEAD)
    probe.drive(0.3, 0.0, 0.0)
    wait_until(lambda: heard(probe).count(ZERO) >= 3, "each command of another program is answered with a zero")
    probe.silence()
    assert AHEAD not in heard(probe)
    anna.ask("drive")
    anna.ask("ask", "reset_stop", "")
    wait_until(lambda: anna.state("stopped_by") == "", "and reset")


def test_who_lets_go_of_the_red_stop_hears_what_the_gate_answers(anna, graph, probe, wait_until):
    gate = graph.run(sys.executable, "-c", GATE)
    gate.wait_for("ready")
    anna.ask("ask", "stop", "")
    wait_until(lambda: anna.state("stopped_by") == "anna", "she stops")
    anna.ask("ask", "reset_stop", "")
    wait_until(lambda: "ben has pressed stop" in str(anna.state("refused")), "the gate's refusal reaches her")
    told = len(anna.state("refused"))
    anna.ask("ask", "reset_stop", "")
    anna.ask("drive", *AHEAD)
    wait_until(lambda: heard(probe)[-1] == AHEAD, "it drives when the gate has let go")
    anna.ask("drive")
    assert len(anna.state("refused")) == told
    assert gate.end() == 0


def stopped_gate(anna, graph, probe, wait_until):
    """Start a gate, and stop the robot."""
    probe.watch("/safety", "telepresence_msgs/SafetyState", ["state"])
    gate = graph.run(sys.executable, "-c", FORGETFUL_GATE)
    wait_until(lambda: probe.latest("/safety") == ["no command"], "nothing is stopped")
    anna.ask("ask", "stop", "")
    wait_until(lambda: probe.latest("/safety") == ["stopped"], "the gate holds it")
    return gate


def test_a_gate_that_has_started_again_is_asked_for_the_red_stop(anna, graph, probe, wait_until):
    """Else what drives past the lease would move a robot that its pilot has stopped."""
    first = stopped_gate(anna, graph, probe, wait_until)
    first.process.kill()
    probe.forget("/safety")
    second = graph.run(sys.executable, "-c", FORGETFUL_GATE)
    wait_until(lambda: "asked to stop" in second.output, "the next gate is asked, too")
    wait_until(lambda: probe.latest("/safety") == ["stopped"], "and holds it")
    asked = second.output.count("asked to stop")
    assert probe.call("/reset_stop", "std_srvs/Trigger", {})[1]["success"], "somebody who may resets it at the gate"
    probe.forget("/safety")
    wait_until(lambda: len(probe.seen("/safety")) > 30, "longer than after which it would be asked again")
    assert second.output.count("asked to stop") == asked and probe.latest("/safety") == ["no command"]
    anna.ask("ask", "reset_stop", "")
    wait_until(lambda: anna.state("stopped_by") == "", "she resets it")
    assert second.end() == 0


def test_a_reset_that_no_gate_hears_is_told(anna, graph, probe, wait_until):
    """It may remember the stop: a reset that nobody has heard would leave the robot stopped, and nobody knew why."""
    first = stopped_gate(anna, graph, probe, wait_until)
    first.process.kill()
    told = len(anna.state("refused"))
    anna.ask("ask", "reset_stop", "")
    wait_until(lambda: "does not answer" in str(anna.state("refused")[told:]), "none comes: she is told")


def test_a_reset_that_was_overtaken_by_a_stop_is_not_asked_of_the_gate(anna, graph, probe, wait_until):
    """While a gate starts again, requests wait for it beside each other. The last of them must be the stop."""
    stopped_gate(anna, graph, probe, wait_until).kill()
    gate = graph.run(sys.executable, "-c", LATE_GATE)
    gate.wait_for("ready")
    anna.ask("ask", "stop", "")
    anna.ask("ask", "reset_stop", "")
    wait_until(lambda: anna.state("stopped_by") == "", "she has reset it")
    anna.ask("ask", "stop", "")
    wait_until(lambda: anna.state("stopped_by") == "anna", "and stopped again")
    told = len(anna.state("refused"))
    anna.ask("ask", "give", "/nobody")  # her window asks for this when the reset is answered
    gate.signal(signal.SIGUSR1)
    wait_until(lambda: "not here any more" in str(anna.state("refused")[told:]), "the reset is answered")
    assert re.findall("asked: (.*)", gate.output)[-1] == "stop_drive"
    anna.ask("ask", "reset_stop", "")
    wait_until(lambda: anna.state("stopped_by") == "", "she resets it")
    gate.wait_for("asked: reset_stop")
    assert gate.end() == 0


def test_a_red_stop_outlasts_the_lease(graph, lease, accounts, anna, probe, wait_until):
    """The next one knows who has pressed it, and so do windows and keyboards."""
    probe.watch("/drive/state", "telepresence_msgs/DriveState", ["epoch", "stopped_by", "hold"])
    anna.ask("ask", "stop", "")
    wait_until(lambda: probe.parameter("/drive_lease/kept")["stopped_by"] == "anna", "the stop is kept")
    began = probe.newest("/drive/state")[0]
    lease.kill()
    graph.run(*lease_command(graph, accounts))
    wait_until(lambda: probe.newest("/drive/state")[0] != began, "the next lease speaks")
    assert probe.newest("/drive/state")[1] == "anna" and "red stop" in probe.newest("/drive/state")[2]
    wait_until(lambda: anna.ask("ask", "reset_stop", "") or not probe.newest("/drive/state")[1], "she resets it")


def test_a_killed_window_leaves_a_zero_and_a_free_robot(anna, graph, accounts, probe, wait_until):
    anna.ask("drive", *AHEAD)
    wait_until(lambda: heard(probe)[-1] == AHEAD, "it drives")
    anna.process.kill()
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot is told to stop")
    again = Remote(graph, accounts, "anna")
    wait_until(lambda: again.state("mine"), "and is free for the next")
    again.close()


def test_a_removed_accounts_window_loses_the_robot_and_learns_why(graph, accounts, probe, wait_until):
    users = Users(accounts)
    users.add("mallory", PASSWORD, "pilot")
    window = Remote(graph, accounts, "mallory")
    wait_until(lambda: window.state("mine"), "it has the robot")
    window.ask("drive", *AHEAD)
    wait_until(lambda: heard(probe)[-1] == AHEAD, "it drives")
    users.remove("mallory")
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot stands")
    wait_until(lambda: window.state("ended") == ["The account of mallory was removed from this robot."], "and says why")
    assert not window.state("session") and window.state("obstacle") == "Sign in to drive."
    window.close()
