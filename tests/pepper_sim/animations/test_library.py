"""All animations: their names, their tags, and their curves, without a robot."""

import itertools

import pytest

from pepper_sim.animations import library
from pepper_sim.animations.generator import RETURN_TIME, TORSO_SPEED, WRIST_SPEED, draw, leading, playable, way
from pepper_sim.body.description import LEG_JOINTS, LIMITS
from pepper_sim.body.postures import CROUCH, STAND

GESTURES = "animations/Stand/Gestures/"
MEANS = 1.5
"""Peak over mean speed between two knots."""


def test_the_documented_animations_are_there():
    paths = library.paths()
    assert len(paths) == len(set(paths)) > 690
    documented = [
        *"Emotions/Negative/Bored_1 Emotions/Positive/Hysterical_1 Gestures/Explain_11 Gestures/ShowSky_9".split(),
        *"Waiting/Think_3 Gestures/YouKnowWhat_6 BodyTalk/BodyTalk_16 Reactions/TouchHead_4".split(),
        *"Waiting/AirGuitar_1 Emotions/Neutral/Sneeze BodyTalk/BodyLanguage/Pepper/Left_Neutral_AFF_07".split(),
        *("Space & time/Pepper/Right_Strong_SAT_06", "Self & others/Pepper/Left_Slow_SAO_02"),
    ]
    assert [path for path in documented if not library.has(f"animations/Stand/{path}")] == []


def test_tags_lead_to_animations_and_back():
    tags = library.tags()
    assert len(tags) > 160
    assert set(tags["hello"]) == {f"{GESTURES}Hey_{number}" for number in (1, 3, 4, 6)}
    assert set(tags["yoo-hoo"]) == {f"{GESTURES}Hey_{number}" for number in (1, 3, 4)}
    assert set(tags["show sky"]) == {"animations/Stand/Waiting/ShowSky_1", "animations/Stand/Waiting/ShowSky_2"}
    assert len(tags["body language"]) == 31 and len(tags["exclamation"]) == 27 and len(tags["left_side"]) == 17
    for tag, paths in tags.items():
        assert paths and all(library.has(path) and tag in library.tags_of(path) for path in paths), tag


@pytest.mark.parametrize("start", [STAND, CROUCH], ids=["standing", "crouching"])
def test_every_animation_keeps_the_limits_and_speeds_of_the_joints(start):
    for path in library.paths():
        for joint, knots in playable(library.curves(path), start, start).items():
            limits = LIMITS[joint]
            top = TORSO_SPEED if joint in LEG_JOINTS else WRIST_SPEED if "Wrist" in joint else limits.velocity / 2
            times = [moment for moment, _ in knots]
            assert times == sorted(set(times)) and times[0] > 0, (path, joint)
            assert all(limits.lower < angle < limits.upper for _, angle in knots[:-1]), (path, joint)
            for (t0, a0), (t1, a1) in itertools.pairwise([(0.0, start[joint]), *knots]):
                assert MEANS * abs(a1 - a0) / (t1 - t0) <= top * 1.01, (path, joint, t1)
            assert knots[-1][1] == start[joint], "it comes back"


def highest(curves, joint):
    return max(angle for _, angle in curves[joint])


def lowest(curves, joint):
    return min(angle for _, angle in curves[joint])


def test_names_decide_what_an_animation_looks_like():
    wave = draw("Hey_1")
    assert lowest(wave, "RShoulderPitch") < -0.3 and "LShoulderPitch" not in wave
    assert "LShoulderPitch" in draw("Hey_2") and "RShoulderPitch" not in draw("Hey_2")
    yes, no = draw("Yes_1"), draw("No_1")
    assert set(yes) == set(no) == {"HeadYaw", "HeadPitch"}
    assert highest(yes, "HeadPitch") - lowest(yes, "HeadPitch") > 0.3 > 0.01 > highest(yes, "HeadYaw")
    assert highest(no, "HeadYaw") > 0.3 and lowest(no, "HeadYaw") < -0.3
    assert lowest(draw("BowShort_1"), "HipPitch") < -0.4
    assert draw("ListeningRight_1")["HeadYaw"][0][1] < -0.3 and draw("ListeningLeft_1")["HeadYaw"][0][1] > 0.3
    assert highest(draw("ShowFloor_1"), "HeadPitch") > 0.3 > 0 > lowest(draw("ShowSky_1"), "HeadPitch") + 0.4
    assert draw("Sad_1")["HeadPitch"][0][1] > 0.3, "a sad robot looks down"
    assert lowest(draw("Happy_1"), "RShoulderPitch") < 0.0 and lowest(draw("Happy_1"), "LShoulderPitch") < 0.0


def test_left_right_and_center_strong_and_slow_are_the_body_language_s():
    left, right = draw("Left_Neutral_SAT_01", ["longrange"]), draw("Right_Neutral_SAT_01", ["longrange"])
    assert lowest(right, "RShoulderRoll") < -0.8 and "LShoulderRoll" not in right
    assert highest(left, "LShoulderRoll") > 0.8 and "RShoulderRoll" not in left
    assert {"LElbowYaw", "RElbowYaw"} <= set(draw("Center_Neutral_SAT_01", ["longrange"]))
    slow, strong = (draw(f"Right_{style}_SAT_01", ["longrange"]) for style in ("Slow", "Strong"))
    assert slow["RShoulderPitch"][-1][0] > strong["RShoulderPitch"][-1][0]
    assert lowest(strong, "RShoulderRoll") < lowest(slow, "RShoulderRoll")


def test_what_has_no_sketch_is_no_animation():
    for name in ("Nobody_1", "Hey-1", ""):
        with pytest.raises(KeyError):
            draw(name)
    with pytest.raises(KeyError, match="none of the tags"):
        draw("Left_Slow_SAT_01", ["left_side"])


def test_the_way_to_the_first_pose_takes_as_long_as_it_must():
    curves = draw("Hey_1")
    far = {**STAND, "RShoulderPitch": 2.0}
    assert leading(curves, STAND)["RShoulderPitch"][0][0] < leading(curves, far)["RShoulderPitch"][0][0]
    assert way(STAND, STAND, ["HeadYaw"]) == {"HeadYaw": [(RETURN_TIME, STAND["HeadYaw"])]}
