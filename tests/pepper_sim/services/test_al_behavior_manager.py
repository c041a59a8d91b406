"""Behaviours of a user's packages: timelines, diagrams and scripts move the robot."""

import math

import choregraphe_files as files
import pytest

from pepper_sim.services import al_behavior_manager

TURN = [files.curve("HeadYaw", [(20, 30)])]
PYTHON_2 = """
class MyClass(GeneratedClass):
    def __init__(self):
        GeneratedClass.__init__(self)
        self.memory = ALProxy("ALMemory")

    def onInput_onStart(self):
        try:
            print "the goal is", self.getParameter("Goal")
            motion = ALProxy("ALMotion")
            number = motion.post.angleInterpolation("HeadPitch", self.getParameter("Goal"), 0.3, True)
            motion.wait(number, 0)
            self.memory.raiseEvent("Box/Done", [self.getName(), self.behaviorId])
        except Exception, error:
            self.logger.error(error)
        self.onStopped()
"""
GOAL = '<Parameter name="Goal" inherits_from_parent="0" content_type="2" value="0.2" default_value="0" id="5" />'
FAILS = """
class MyClass(GeneratedClass):
    def onInput_onStart(self, p):
        raise RuntimeError("no bananas")
"""
QIANIM = (
    '<Animation typeVersion="2.0"><ActuatorCurve fps="25" actuator="HeadYaw" mute="false" unit="radian">'
    '<Key value="-0.5" frame="10"/></ActuatorCurve></Animation>'
)


@pytest.fixture
def install(naoqi, simulation, tmp_path):
    installed = []

    def go(behaviors, uuid="dances", tags=()):
        naoqi.simulation.server.catalogue.packages.install(files.package(tmp_path / "a.pkg", uuid, behaviors, tags))
        installed.append(uuid)

    yield go
    naoqi.ALBehaviorManager.stopAllBehaviors()
    for uuid in dict.fromkeys(installed):
        simulation.server.catalogue.packages.remove(uuid)


def test_a_behavior_that_does_not_start_does_not_run(naoqi, install, refused, monkeypatch):
    manager = naoqi.ALBehaviorManager
    install({"talk/behavior.xar": files.behavior(files.in_turn(files.script_box(1, FAILS)))})

    def no_process(*_):
        raise OSError("Cannot allocate memory")

    monkeypatch.setattr(al_behavior_manager, "BehaviorProcess", no_process)
    for _ in range(2):
        assert "allocate" in refused(manager.startBehavior, "dances/talk")
    assert manager.isBehaviorRunning("dances/talk") is False and manager.getRunningBehaviors() == []
    assert naoqi.ALMemory.getData("BehaviorsRun") == []


def test_a_timeline_moves_the_joints(naoqi, install):
    manager, motion = naoqi.ALBehaviorManager, naoqi.ALMotion
    added = []
    manager.behaviorsAdded.connect(added.append)
    dance = files.behavior(files.in_turn(files.timeline_box(1, TURN)))
    install({"turn/behavior.xar": dance, "nod.qianim": QIANIM}, tags=["agree"])
    assert {"dances/turn", "dances/nod"} <= set(manager.getUserBehaviorNames())
    manager.runBehavior("dances/turn")
    assert motion.getAngles("HeadYaw", True)[0] == pytest.approx(math.radians(30), abs=0.02)
    naoqi.ALAnimationPlayer.run("dances/nod")
    assert motion.getAngles("HeadYaw", True)[0] == pytest.approx(-0.5, abs=0.02)
    assert manager.getBehaviorTags("dances/nod") == ["agree"] and "agree" in manager.getTagList()
    assert manager.getBehaviorNature("dances/nod") == "solitary"
    assert manager.resolveBehaviorName("nod") == "dances/nod"


def test_a_package_s_own_tags(naoqi, install, refused):
    player = naoqi.ALAnimationPlayer
    install({"Stand/nod.qianim": QIANIM}, tags=["agree"])
    assert "agree" in refused(player.runTag, "agree"), "not yet declared"
    player.declarePathForTags("dances/[posture]/")
    player.runTag("agree")
    assert naoqi.ALMotion.getAngles("HeadYaw", True)[0] == pytest.approx(-0.5, abs=0.02)
    player.reset()


def test_stopping_ends_the_motion(naoqi, install, wait_until):
    manager, motion = naoqi.ALBehaviorManager, naoqi.ALMotion
    slow = files.timeline_box(1, [files.curve("HeadYaw", [(2500, 60)])])
    install({"slow/behavior.xar": files.behavior(files.in_turn(slow))})
    manager.startBehavior("dances/slow")
    wait_until(lambda: motion.getTaskList(), "it moves")
    assert manager.isBehaviorRunning("dances/slow") and naoqi.ALMemory.getData("BehaviorsRun") == ["dances/slow"]
    manager.stopBehavior("dances/slow")
    wait_until(lambda: not motion.getTaskList(), "it has ended")
    assert not manager.isBehaviorRunning("dances/slow")


def test_a_script_of_python_2_runs_in_a_process_of_its_own(naoqi, install, wait_until):
    done = []
    subscriber = naoqi.ALMemory.subscriber("Box/Done")
    subscriber.signal.connect(done.append)
    boxes = files.in_turn(files.timeline_box(1, TURN), files.script_box(2, PYTHON_2, "Tilt", GOAL))
    install({"tilt/behavior.xar": files.behavior(boxes)})
    naoqi.ALBehaviorManager.runBehavior("dances/tilt")
    yaw, pitch = naoqi.ALMotion.getAngles("Head", True)
    assert yaw == pytest.approx(math.radians(30), abs=0.02) and pitch == pytest.approx(0.2, abs=0.02)
    wait_until(lambda: done == [["Tilt", "dances/tilt"]], "the script has raised its event")


def test_a_script_that_fails_is_reported(naoqi, install, wait_until, refused):
    failed = []
    naoqi.ALBehaviorManager.behaviorFailed.connect(lambda *what: failed.append(what))
    ape = files.behavior(files.in_turn(files.script_box(1, FAILS, "Ape")))
    install({"fail/behavior.xar": ape, "bad/behavior.xar": "<x"})
    naoqi.ALBehaviorManager.runBehavior("dances/fail")
    wait_until(lambda: failed, "the failure is reported")
    assert failed == [("dances/fail", "Ape", "RuntimeError: no bananas")]
    assert "behavior.xar cannot be read" in refused(naoqi.ALBehaviorManager.runBehavior, "dances/bad")


def test_default_behaviours_start_together(naoqi, refused):
    manager = naoqi.ALBehaviorManager
    manager.addDefaultBehavior("robotvideo/behaviour")
    manager.playDefaultProject()
    assert manager.getRunningBehaviors() == manager.getLoadedBehaviors() == manager.getDefaultBehaviors()
    manager.stopAllBehaviors()
    manager.removeDefaultBehavior("robotvideo/behaviour")
    assert "no default" in refused(manager.removeDefaultBehavior, "robotvideo/behaviour")
