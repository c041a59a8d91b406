"""The body itself against the published figures."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from pepper_sim.body.description import CONTINUOUS_TORQUE, JOINTS, LIMITS
from pepper_sim.body.frames import ROOT, Frames
from pepper_sim.body.postures import POSTURES
from pepper_sim.models import load_pepper
from pepper_sim.models.shells import HULL_TOP, loft, outline


@pytest.fixture(name="body", scope="module")
def _body():
    model = load_pepper().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_mass_and_centre_of_mass(body):
    model, data = body
    assert model.body_mass.sum() == pytest.approx(28.681 + 0.04, abs=0.005)  # the fingers' bodies weigh 20 g each
    assert data.subtree_com[model.body(ROOT).id] == pytest.approx((0.0095, 0.0, 0.414), abs=0.003)


@pytest.mark.parametrize(
    ("link", "place"),
    [
        ("torso", (0.0, 0.0, 0.820)),
        ("Head", (-0.038, 0.0, 0.990)),
        ("l_wrist", (0.272, 0.165, 0.930)),
        ("r_wrist", (0.272, -0.165, 0.930)),
        ("Hip", (0.0, 0.0, 0.681)),
        ("Pelvis", (0.0, 0.0, 0.602)),
        ("Tibia", (0.0, 0.0, 0.334)),
        ("CameraTop_frame", (0.048, 0.0, 1.153)),
        ("CameraBottom_frame", (0.0546, 0.0, 1.052)),
        ("CameraDepth_frame", (0.0134, 0.039, 1.109)),
        ("Tablet_frame", (0.084, 0.0, 0.883)),
        ("SonarFront_frame", (0.0699, 0.0, 0.2317)),
    ],
)
def test_links_are_where_the_urdf_puts_them(body, link, place):
    model, data = body
    assert Frames(model, "").find(data, link)[1] == pytest.approx(place, abs=1e-3)


def test_leg_joints_keep_the_sign_of_naoqi(body):
    """Positive pitch bends forward, seen from the torso; here the base is the root."""
    model, _ = body
    data = mujoco.MjData(model)
    for joint, axis in (("KneePitch", 1), ("HipPitch", 1), ("HipRoll", 0)):
        data.qpos[:] = model.qpos0
        data.joint(joint).qpos = 0.3
        mujoco.mj_kinematics(model, data)
        torso = Frames(model, "").find(data, "torso")[0]
        base_in_torso = torso.T @ Frames(model, "").find(data, ROOT)[0]
        angles = (math.atan2(base_in_torso[2, 1], base_in_torso[2, 2]), -math.asin(base_in_torso[2, 0]))
        assert angles[axis] == pytest.approx(0.3)


def test_joints_and_servos_have_the_stated_limits(body):
    model, _ = body
    assert [model.actuator(i).name for i in range(3, model.nu)] == list(JOINTS)
    for joint, limits in LIMITS.items():
        assert model.joint(joint).range == pytest.approx((limits.lower, limits.upper))
        assert model.actuator(joint).forcerange == pytest.approx((-limits.effort, limits.effort))


@pytest.mark.parametrize(
    ("camera", "horizontal", "vertical"),
    [("CameraTop", 57.2, 44.3), ("CameraBottom", 57.2, 44.3), ("CameraDepth", 58.0, 45.0)],
)
def test_cameras_have_the_documented_field_of_view(body, camera, horizontal, vertical):
    fovy = float(body[0].camera(camera).fovy[0])
    assert fovy == pytest.approx(vertical)
    assert math.degrees(2 * math.atan(4 / 3 * math.tan(math.radians(fovy) / 2))) == pytest.approx(horizontal, abs=0.3)


def test_cameras_look_along_x_of_their_frames(body):
    model, data = body
    for name in ("CameraTop", "CameraBottom", "CameraDepth"):
        rotation, position = Frames(model, "").find(data, name + "_frame")
        assert data.camera(name).xpos == pytest.approx(position)
        assert -data.camera(name).xmat.reshape(3, 3)[:, 2] == pytest.approx(rotation[:, 0], abs=1e-5)


def test_outer_dimensions(body):
    model, data = body
    angles = np.linspace(-math.pi, math.pi, 721)
    reach = outline(angles)
    x, y = reach * np.cos(angles), reach * np.sin(angles)
    assert y.max() - y.min() == pytest.approx(0.48, abs=0.005)
    assert x.max() - x.min() == pytest.approx(0.425, abs=0.01)
    head = model.geom_dataid == model.mesh("head").id
    first = model.mesh("head").vertadr[0]
    vertices = model.mesh_vert[first : first + model.mesh("head").vertnum[0]]
    top = (vertices @ data.geom_xmat[head].reshape(3, 3).T + data.geom_xpos[head])[:, 2].max()
    assert top == pytest.approx(1.21, abs=0.005)
    assert HULL_TOP < 0.334


def test_is_cheap_to_draw(body):
    assert body[0].ngeom <= 50


def test_nothing_of_the_robot_touches_itself(body):
    model, _ = body
    for posture in POSTURES.values():
        data = mujoco.MjData(model)
        for joint, angle in posture.items():
            data.joint(joint).qpos = angle
        mujoco.mj_forward(model, data)
        assert data.ncon == 0


def test_a_loft_is_closed_and_faces_outwards():
    angles = np.arange(8) * math.tau / 8
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = np.array([np.column_stack([ring, np.full(8, z)]) for z in (0.0, 1.0, 2.0)])
    vertices, triangles = loft(rings)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(2.0 * 8 / 2 * math.sin(math.tau / 8))
    edges = {(int(t[i]), int(t[(i + 1) % 3])) for t in triangles for i in range(3)}
    assert all((b, a) in edges for a, b in edges)


def test_postures_are_complete_and_within_the_limits():
    for name, posture in POSTURES.items():
        assert list(posture) == list(JOINTS), name
        for joint, angle in posture.items():
            assert LIMITS[joint].lower - 1e-3 <= angle <= LIMITS[joint].upper + 1e-3, (name, joint)
    assert set(CONTINUOUS_TORQUE) == set(JOINTS)
