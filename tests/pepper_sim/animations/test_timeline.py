"""Timelines in files: Choregraphe's and the animation editor's, read without a robot."""

import math
from concurrent.futures import Future

import choregraphe_files as files
import pytest

from pepper_sim.animations.behavior import read_behavior
from pepper_sim.animations.flow import Flow
from pepper_sim.animations.timeline import NotReadable, read_qianim
from pepper_sim.body.postures import STAND

QIANIM = """<?xml version="1.0" encoding="utf-8"?>
<Animation xmlns:editor="http://www.aldebaran.com/animation/editor" typeVersion="2.0" editor:fps="25">
 <ActuatorCurve fps="25" actuator="LShoulderPitch" mute="false" unit="degree">
  <Key value="45" frame="25">
   <Tangent side="left" abscissaParam="-8" ordinateParam="0" editor:interpType="bezier"/>
  </Key>
  <Key value="90" frame="50"/>
 </ActuatorCurve>
 <ActuatorCurve fps="25" actuator="LHand" mute="false" unit="dimensionless"><Key value="0.9" frame="0"/></ActuatorCurve>
 <ActuatorCurve fps="25" actuator="HeadYaw" mute="true" unit="degree"><Key value="45" frame="25"/></ActuatorCurve>
</Animation>"""


@pytest.fixture
def written(tmp_path):
    def write(text, name="behavior.xar"):
        file = tmp_path / name
        file.write_text(text)
        return file

    return write


class Stage:
    """Plays at once, and remembers what."""

    def __init__(self):
        self.played = []

    def play(self, timeline):
        self.played.append(sorted(timeline.curves))
        done = Future()
        done.set_result(True)
        return done

    def load(self, box, emit):
        raise AssertionError("there is no script")


def test_a_file_of_the_animation_editor(written):
    timeline = read_qianim(written(QIANIM, "wave.qianim"))
    assert set(timeline.curves) == {"LShoulderPitch", "LHand"}, "what is muted does not move"
    first, second = timeline.curves["LShoulderPitch"]
    assert (first.moment, first.angle, first.left) == (1.0, math.radians(45), (-0.32, 0.0))
    assert timeline.duration == second.moment == 2.0
    knots = timeline.knots(STAND)
    assert knots["LHand"][-1] == (2.0, 0.9) and knots["LShoulderPitch"][-1][1] == pytest.approx(math.pi / 2)
    times = [moment for moment, _ in knots["LShoulderPitch"]]
    assert times == sorted(set(times)) and times[0] > 0


def test_a_behaviour_is_its_boxes(written):
    curves = [files.curve("HeadYaw", [(25, 30)]), files.curve("RHand", [(10, 0.5)], unit=1)]
    dance = files.timeline_box(1, curves, end=50)
    root = read_behavior(written(files.behavior(files.in_turn(dance))))
    (_, diagram), (box,) = root.diagrams[0], root.diagrams[0][1].boxes.values()
    assert box.timeline.curves["HeadYaw"][0].angle == pytest.approx(math.radians(30))
    assert box.timeline.curves["HeadYaw"][0].moment == 1.0 and box.timeline.curves["RHand"][0].angle == 0.5
    assert box.timeline.duration == pytest.approx(2.0, abs=0.05) and len(diagram.links) == 2


def test_signals_travel_from_box_to_box(written):
    first = files.timeline_box(1, [files.curve("HeadYaw", [(2, 30)])])
    inside = files.flow_box(2, files.in_turn(files.timeline_box(1, [files.curve("HeadPitch", [(2, 10)])])))
    stage = Stage()
    Flow(read_behavior(written(files.behavior(files.in_turn(first, inside)))), stage).run()
    assert stage.played == [["HeadYaw"], ["HeadPitch"]]


def test_a_timeline_starts_what_stands_at_its_frames(written):
    nested = files.layer(files.in_turn(files.timeline_box(1, [files.curve("LHand", [(1, 1)], unit=1)])), index=2)
    stage = Stage()
    waiting = Future()
    play = stage.play

    def play_first(timeline):
        play(timeline)
        if "LHand" not in timeline.curves:
            return waiting
        waiting.set_result(True)
        return Future()

    stage.play = play_first
    outer = files.timeline_box(1, [files.curve("HeadYaw", [(25, 30)])], layers=nested)
    Flow(read_behavior(written(files.behavior(files.in_turn(outer)))), stage).run()
    assert stage.played == [["HeadYaw"], ["LHand"]]


def test_a_behaviour_without_an_end_is_stopped(written):
    flow = Flow(read_behavior(written(files.behavior(files.diagram([], [])))), Stage())
    flow.stop()
    flow.run()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("<Animation", "cannot be read"),
        ("<svg/>", "first element is 'svg'"),
        (files.behavior(files.in_turn(files.timeline_box(1, [files.curve("Tail", [(1, 1)])]))), "no joint 'Tail'"),
        (files.behavior(files.in_turn(files.timeline_box(1, [files.curve("HeadYaw", [(1, 1)], 9)]))), "unit '9'"),
        (files.behavior(files.in_turn(files.timeline_box(1, [files.curve("HeadYaw", [(1, "x")])]))), "value 'x'"),
        (files.behavior(files.in_turn(files.timeline_box("one", []))), "id 'one'"),
    ],
)
def test_what_is_no_behaviour_is_refused(written, text, says):
    with pytest.raises(NotReadable, match=says):
        read_behavior(written(text))


def test_an_animation_of_more_than_an_hour_is_refused_before_it_is_sampled(written):
    with pytest.raises(NotReadable, match="at most 3600 s"):
        read_qianim(written(QIANIM.replace('frame="50"', 'frame="100000"'), "endless.qianim"))


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(NotReadable, match="No such file"):
        read_qianim(tmp_path / "none.qianim")
