"""Services that are called by the window's real link."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.ros

PROGRAMS = """
import os, sys, time, rospy
from std_srvs.srv import SetBool
rospy.init_node("programs", anonymous=True)
def slow(request):
    time.sleep(2.0)
    return True, ""
def dies(request):
    os._exit(0)
action = {"talk": slow, "mute_microphone": dies, "conversation": lambda request: (True, "")}
for name in sys.argv[1:]:
    rospy.Service(f"voice/{name}", SetBool, action[name])
print("offered", flush=True)
rospy.spin()
"""
WINDOW = """
from dataclasses import replace
from PyQt5.QtCore import QCoreApplication, QTimer
from gui.robots import ROBOTS
from gui.ros.link import RosLink
from gui.ros.node import RosNode

application = QCoreApplication([])
node, robot = RosNode(), ROBOTS["pepper"]
quick = tuple(replace(row, timeout=0.5) for row in robot.services)
link = RosLink(node, replace(robot, services=quick))

def call(title, name, wanted, after=lambda: None, **more):
    def answered(answer):
        print(title, answer.ok, answer.arrived, flush=True)
        after()

    link.call(name, wanted, then=answered, **more)

def begin():
    if not node.joined:
        return
    timer.stop()
    call("impatient", "talk", True, after=end)  # finish() blocks: what it waited for could come before its time-out
    call("patient", "talk", True, patient=True)
    call("dying", "mute_microphone", True, patient=True)
    call("nobody", "mute_speaker", True, patient=True)

def end():
    link.set_open(False)
    call("signed out", "conversation", True)
    call("ending", "conversation", False, signed_out=True)
    link.finish(10.0)
    print("finished", flush=True)

timer = QTimer(interval=50)
timer.timeout.connect(begin)
timer.start()
node.start()
application.exec_()
"""


def test_every_call_gets_the_answer_that_it_waits_for(ros_master, run_program, wait_until, tmp_path):
    for names in (("talk", "conversation"), ("mute_microphone",)):
        services = run_program(sys.executable, "-c", PROGRAMS, *names, stdout=subprocess.PIPE, text=True)
        assert services.stdout.readline() == "offered\n"
    output = tmp_path / "output"
    with output.open("w") as file:
        run_program(sys.executable, "-c", WINDOW, stdout=file)
    wanted = {
        "impatient False False",
        "patient True True",
        "dying False False",
        "nobody False False",
        "signed out False False",
        "ending True True",
        "finished",
    }
    lines = lambda: output.read_text().splitlines()  # noqa: E731
    wait_until(lambda: wanted <= set(lines()), "every answer has come")
    assert lines().index("ending True True") < lines().index("finished"), "nothing ends before it is heard"
