import mujoco
import numpy as np
import pytest

from pepper_sim.models import pepper_model
from robotino_sim.models import robotino_model
from telepresence.sim.camera import Cameras
from telepresence.sim.scene import build_world, load_scene


@pytest.fixture(scope="module")
def model():
    return load_scene("arena").compile()


@pytest.mark.parametrize("diameter", [2, 3, 5, 8, 12, 20, 40])
def test_poles_are_as_thick_as_their_names_say(model, diameter):
    geom = model.geom(f"pole_{diameter:02d}")
    assert geom.size[0] == pytest.approx(diameter / 200)
    assert (geom.contype[0], geom.conaffinity[0]) == (1, 1)


@pytest.mark.parametrize("body", ["box_large", "box_small", "crate", "ball"])
def test_movable_things_have_a_free_joint(model, body):
    joint = model.body(body).jntadr[0]
    assert model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE


def test_person_can_be_placed_by_a_program(model):
    assert model.body("person").mocapid[0] >= 0


def test_both_robots_start_free_of_everything():
    world = build_world("arena", [pepper_model(), robotino_model()])
    world.step(200)
    with world.locked() as data:
        touching = {world.model.geom(int(geom)).name for pair in data.contact.geom for geom in pair}
        heights = [data.body(name).xpos[2] for name in ("pepper/base_footprint", "robotino/base_link")]
    assert not {name for name in touching if name.startswith(("wall", "barrier", "pole", "board"))}
    assert heights == pytest.approx([0.0, 0.0], abs=0.003)
    world.close()


def test_walls_are_closed():
    """From the middle, rays at the height of a Robotino's sensors end within the room all around."""
    world = build_world("arena")
    with world.locked() as data:
        hit = np.zeros(1, np.int32)
        for angle in np.linspace(0.0, 2 * np.pi, 180, endpoint=False):
            direction = np.array([np.cos(angle), np.sin(angle), 0.0])
            for height in (0.0566, 0.2015, 1.0):
                start = np.array([0.0, 1.3, height])
                distance = mujoco.mj_ray(world.model, data, start, direction, None, True, -1, hit)
                assert 0.0 < distance < 6.5
    world.close()


def test_overview_shows_the_room():
    world = build_world("arena", [robotino_model()])
    cameras = Cameras(world)
    with cameras.subscribe("overview", 320, 240, 30.0) as feed:
        picture = feed.image.wait_newer(0, timeout=30.0)
    cameras.close()
    world.close()
    assert picture is not None
    assert picture.content.std() > 30.0
    assert len(np.unique(picture.content.reshape(-1, 3) // 16, axis=0)) > 100
