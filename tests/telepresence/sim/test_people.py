"""People of a world: they stand where they are told, walk, wait for robots, wave and look."""

import math

import mujoco
import numpy as np
import pytest

from pepper_sim.simulation import Simulation
from telepresence.sim.person_request import PersonRequest


@pytest.fixture(scope="module")
def simulation():
    people = ["standing@1.5,0", "walking@2.5,-1;2.5,-2", "waving@1.5,1", "seated@-2,0,90"]
    with Simulation("empty", port=0, start=False, people=people) as standing:
        yield standing


@pytest.fixture
def world(simulation):
    simulation.restart()
    return simulation.world


def test_people_stand_where_they_were_put_and_face_the_robot(world):
    first, *_, seated = world.people
    assert [person.name for person in world.people] == ["person_1", "person_2", "person_3", "person_4"]
    assert first.position == pytest.approx((1.5, 0.0, 0.0)) and abs(first.heading) == pytest.approx(math.pi)
    assert seated.position == pytest.approx((-2.0, 0.0, 0.0)) and seated.heading == pytest.approx(math.pi / 2)
    assert seated.figure.posture == "seated"
    with pytest.raises(KeyError, match="person_1"):
        world.people["nobody"]


def test_a_person_walks_to_and_fro_and_starts_again_with_the_world(world):
    walker = world.people["person_2"]
    seen = []
    for _ in range(16):
        world.step(50)
        seen.append(walker.position[1])
    assert min(seen) < -1.9 and max(seen[-4:]) > -1.2
    world.reset()
    assert walker.position == pytest.approx((2.5, -1.0, 0.0))


def test_a_walk_ends_before_the_robot(world):
    walker = world.people["person_1"]
    walker.walk([(-2.0, 0.0)])
    world.step(600)
    assert 0.7 < walker.position[0] < 0.8


def test_a_hand_waves_and_the_rest_stays(world):
    waving = world.people["person_3"]
    before, places = waving.position, []
    for _ in range(30):
        world.step(8)
        places.append(waving.hand())
    assert np.ptp(np.array(places)[:, 1]) > 0.15 and waving.position == before
    waving.wave(False)
    world.step(10)
    assert waving.hand() == pytest.approx((0.215, -0.302, 1.41))
    assert world.people["person_4"].hand() is None


def test_a_head_turns_to_the_robot_only_while_it_is_in_front(world):
    person = world.people["person_1"]
    person.place(1.5, 0.5, math.pi)
    world.step(200)
    rotation, _ = person.head_pose()
    assert math.atan2(rotation[1, 0], rotation[0, 0]) == pytest.approx(-math.pi + math.atan2(0.5, 1.5), abs=0.05)
    person.place(1.5, 0.5, 0.0)
    world.step(200)
    rotation, neck = person.head_pose()
    assert rotation[:, 0] == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    assert neck == pytest.approx((1.505, 0.5, 1.475))


def test_people_of_a_scene_are_its_people_too():
    with Simulation("apartment", port=0, start=False, people="standing@1,0") as flat:
        assert {person.name for person in flat.world.people} == {"person_seated", "person_standing", "person_1"}
        carer = flat.world.people["person_standing"]
        assert carer.figure.posture == "standing" and len(carer.bodies) == 3
        model, before = flat.world.model, carer.position
        flat.world.step(20)
        assert carer.position == before
        names = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) for body in carer.bodies}
        assert names == {"person_standing", "person_standing_head", "person_standing_arm"}


@pytest.mark.parametrize(
    "text",
    [
        "standing",
        "flying@1,0",
        "standing@1",
        "standing@a,b",
        "walking@1,0",
        "standing@1,0;2,0",
        "standing@nan,0",
        "@1,0",
    ],
)
def test_what_is_no_person_is_refused(text):
    with pytest.raises(ValueError, match="is no person"):
        PersonRequest.parse(text)
