"""Cameras: real pictures drawn without a display."""

from __future__ import annotations

import math
import os
import time

import mujoco
import numpy as np
import pytest

from telepresence.sim.camera import Cameras, CamerasFailed, next_due
from telepresence.sim.painter import SKY_KEPT, Painter
from telepresence.sim.world import World

ROOM = """
<mujoco>
  <visual>
    <global offwidth="640" offheight="480"/>
    <quality offsamples="0"/>
    <map znear=".02" zfar="60"/>
    <headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/>
  </visual>
  <statistic extent="1"/>
  <asset>
    <texture name="screen" type="2d" builtin="flat" width="64" height="40" rgb1="0 0 0" rgb2="0 0 0" nchannel="3"/>
    <material name="screen" texture="screen" emission="1" specular="0" texuniform="false" texrepeat="1 1"/>
  </asset>
  <worldbody>
    <camera name="eye" pos="0 0 1" xyaxes="0 -1 0 0 0 1" fovy="45"/>
    <camera name="behind" pos="0 0 1" xyaxes="0 1 0 0 0 1" fovy="45"/>
    <geom name="wall" type="box" pos="2.1 0 1" size=".1 9 9" rgba="1 0 0 1"/>
    <geom type="box" size=".32 .2 .01" pos="-1 0 1" xyaxes="0 1 0 0 0 1" material="screen"/>
    <body name="door" pos="1 0 1"><joint name="slide" type="slide" axis="0 0 1"/>
      <geom type="box" size=".05 .1 .1" rgba="0 1 0 1" contype="0" conaffinity="0"/></body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(name="world")
def _world():
    world = World(mujoco.MjSpec.from_string(ROOM))
    world.model.opt.gravity[:] = 0.0
    yield world
    world.close()


@pytest.fixture(name="cameras")
def _cameras(world):
    cameras = Cameras(world)
    yield cameras
    cameras.close()


def newest(feed, after: int = 0):
    picture = feed.image.wait_newer(after, 20.0)
    assert picture is not None, "no picture came"
    return picture


def test_a_display_is_not_needed():
    assert os.environ["MUJOCO_GL"]
    assert os.environ["LP_NUM_THREADS"]


@pytest.mark.parametrize(("width", "height"), [(640, 480), (320, 240), (80, 60)])
def test_one_context_serves_every_size(cameras, width, height):
    pixels = newest(cameras.subscribe("eye", width, height, 10.0)).content
    assert pixels.shape == (height, width, 3) and pixels.dtype == np.uint8
    assert pixels[height // 2, width // 2].tolist() == [0, 255, 0]
    assert pixels[2, 2].tolist() == [255, 0, 0]


def test_depth_is_metres_along_the_optical_axis(cameras):
    depth = newest(cameras.subscribe("eye", 160, 120, 10.0, "depth")).content
    assert depth.shape == (120, 160) and depth.dtype == np.float32
    assert depth[60, 80] == pytest.approx(0.95, abs=1e-3)
    assert depth[2, 2] == pytest.approx(2.0, abs=2e-3)


def test_a_picture_shows_the_instant_of_its_stamp(world, cameras):
    feed = cameras.subscribe("eye", 80, 60, 50.0)
    first = newest(feed)
    with world.locked() as data:
        data.qpos[0] = 5.0
    world.step(1)
    later = newest(feed, first.sequence + 1)
    assert later.content[30, 40].tolist() == [255, 0, 0]
    assert later.stamp == pytest.approx(world.stamp)
    assert first.stamp < later.stamp


def test_feeds_of_one_size_share_a_picture_that_nobody_may_change(cameras):
    feed = cameras.subscribe("eye", 80, 60, 20.0)
    with pytest.raises(ValueError, match="read-only"):
        newest(feed).content[0, 0] = 0


@pytest.fixture(name="painted")
def _painted(world, monkeypatch):
    """A painter, and the cameras that it painted for."""
    cameras = []
    paint = Painter._paint
    monkeypatch.setattr(
        Painter, "_paint", lambda self, camera, *more: (cameras.append(camera), paint(self, camera, *more))[1]
    )
    painter = Painter(world)
    yield painter, cameras
    painter.close()


def draw(painter: Painter, world: World, camera: str) -> np.ndarray:
    painter.snapshot()
    return painter.draw(world.model.camera(camera).id, 80, 60, "rgb")


@pytest.mark.parametrize(("moved", "again"), [(0.0, False), (1e-6, False), (0.05, True), (5.0, True), (math.nan, True)])
def test_a_picture_in_which_nothing_has_moved_is_not_painted_again(world, painted, moved, again):
    painter, cameras = painted
    before = draw(painter, world, "eye")
    with world.locked() as data:
        data.qpos[0] += moved
    later = draw(painter, world, "eye")
    assert (later is not before, len(cameras)) == (again, 1 + again)


@pytest.mark.parametrize("kind", ["rgb", "depth"])
def test_a_picture_is_the_same_in_a_room_that_fits_it(world, painted, kind):
    painter, _ = painted
    painter.snapshot()
    pictures = []
    for room in ((640, 480), (80, 60), (160, 480)):
        painter.fit(*room)
        painter._drawn.clear()  # else nothing would be painted again
        pictures.append(painter.draw(world.model.camera("eye").id, 80, 60, kind))
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures[1:])


def test_the_room_fits_those_pictures_that_are_wanted(cameras, monkeypatch):
    rooms = []
    fit = Painter.fit
    monkeypatch.setattr(Painter, "fit", lambda self, *size: (rooms.append(size), fit(self, *size)))
    wide = cameras.subscribe(("eye", "behind"), 640, 60, 50.0)
    high = cameras.subscribe("eye", 80, 200, 50.0)
    assert newest(wide).content.shape[:2] == (60, 640) and newest(high).content.shape[:2] == (200, 80)
    assert rooms[-1] == (320, 200), "two cameras side by side are painted one after the other"
    wide.close()
    newest(high, high.image.peek().sequence + 1)
    assert rooms[-1] == (80, 200)
    assert newest(cameras.subscribe("eye", 640, 480, 50.0)).content[2, 2].tolist() == [255, 0, 0]


@pytest.mark.parametrize("sizes", [[], [(80, 60)], [(80, 60), (320, 240)]])
def test_the_buffer_has_depth_and_no_stencil(painted, sizes):
    """Which would double what every point of every picture reads and writes."""
    from OpenGL import GL  # not at the top: MuJoCo tells it first for which kind of context it works

    painter, _ = painted
    for size in sizes:
        painter.fit(*size)
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, painter._context.offFBO)
    assert GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER) == GL.GL_FRAMEBUFFER_COMPLETE
    attached = (GL.GL_STENCIL_ATTACHMENT, GL.GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE)
    assert GL.glGetFramebufferAttachmentParameteriv(GL.GL_FRAMEBUFFER, *attached) == GL.GL_NONE
    GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, painter._context.offDepthStencil)
    made = GL.glGetRenderbufferParameteriv(GL.GL_RENDERBUFFER, GL.GL_RENDERBUFFER_INTERNAL_FORMAT)
    assert made == GL.GL_DEPTH_COMPONENT32F


def test_textures_are_filtered_cheaply_also_those_that_change(painted):
    from OpenGL import GL  # not at the top: MuJoCo tells it first for which kind of context it works

    painter, _ = painted
    texture = int(painter._context.texture[0])
    for change in ({}, {0: np.zeros((40, 64, 3), np.uint8)}):
        painter.upload(change)
        GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
        chosen = GL.glGetTexParameteriv(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_MIN_FILTER)
        assert chosen == GL.GL_LINEAR_MIPMAP_NEAREST


def test_slow_movement_adds_up_until_it_is_painted(world, painted):
    painter, cameras = painted
    first = draw(painter, world, "eye")
    for _ in range(1000):
        with world.locked() as data:
            data.qpos[0] += 5e-5
        last = draw(painter, world, "eye")
    assert len(cameras) > 300 and not np.array_equal(first, last)


def test_what_moves_behind_a_camera_is_not_painted(world, painted):
    painter, cameras = painted
    before = draw(painter, world, "behind")
    with world.locked() as data:
        data.qpos[0] = 0.5
    assert draw(painter, world, "behind") is before and len(cameras) == 1


def test_a_changed_colour_is_painted(world, painted):
    painter, cameras = painted
    draw(painter, world, "behind")
    world.model.mat_rgba[0] = (1.0, 0.0, 0.0, 1.0)
    draw(painter, world, "behind")
    assert len(cameras) == 2


SKY = '<texture type="skybox" builtin="gradient" rgb1="0 .5 1" rgb2=".2 .7 1" width="32" height="192"/>'


@pytest.mark.parametrize(("camera", "seen"), [("eye", False), ("behind", True)])
def test_the_sky_is_painted_where_it_is_seen(camera, seen, monkeypatch):
    """Every picture is what it would be if the sky were always painted."""
    world, skies = World(mujoco.MjSpec.from_string(ROOM.replace("<asset>", f"<asset>{SKY}"))), []
    paint = Painter._draw_colours
    monkeypatch.setattr(
        Painter, "_draw_colours", lambda self, area, sky: (skies.append(sky), paint(self, area, sky))[1]
    )
    painter = Painter(world)
    for _ in range(SKY_KEPT + 3):
        painter._drawn.clear()  # else nothing would be painted again
        picture = draw(painter, world, camera)
        expected = paint(painter, mujoco.MjrRect(0, 0, 80, 60), True)[::-1]
        assert np.array_equal(picture, expected)
    assert skies.count(True) == (SKY_KEPT + 3 if seen else 0)
    assert skies.count(False) == (2 if seen else SKY_KEPT + 3), "now and then it looks whether the sky is still there"
    painter.close()
    world.close()


def test_a_new_texture_is_seen_upright_and_unmirrored(cameras):
    feed = cameras.subscribe("behind", 320, 240, 30.0)
    newest(feed)
    pixels = np.zeros((40, 64, 3), np.uint8)
    pixels[:10, :16] = (0, 0, 255)
    cameras.set_texture("screen", pixels)
    deadline = time.monotonic() + 20.0
    blue = np.zeros((0, 2))
    while not len(blue) and time.monotonic() < deadline:
        shown = newest(feed, feed.image.peek().sequence).content
        blue = np.argwhere((shown[:, :, 2] > 200) & (shown[:, :, 0] < 50))
    assert len(blue), "the texture was not shown"
    row, column = blue.mean(axis=0)
    assert row < 120 and column < 160


def test_a_texture_that_no_picture_shows_costs_nothing_and_is_there_when_one_does(cameras, monkeypatch):
    uploaded = []
    upload = Painter.upload
    monkeypatch.setattr(Painter, "upload", lambda self, textures: (uploaded.extend(textures), upload(self, textures)))
    away = cameras.subscribe("eye", 80, 60, 50.0)
    blue = np.zeros((40, 64, 3), np.uint8)
    blue[:] = (0, 0, 255)
    cameras.set_texture("screen", blue)
    newest(away, away.image.peek().sequence + 5 if away.image.peek() else 5)
    assert not uploaded
    shown = newest(cameras.subscribe("behind", 320, 240, 30.0)).content
    assert len(uploaded) == 1
    assert ((shown[:, :, 2] > 200) & (shown[:, :, 0] < 50)).any(), "the first picture has it"


def test_closing_a_feed_ends_its_pictures(cameras):
    open_feed = cameras.subscribe("eye", 80, 60, 50.0)
    with cameras.subscribe("behind", 80, 60, 50.0) as feed:
        newest(feed)
    newest(open_feed, open_feed.image.peek().sequence + 1)
    last = feed.image.peek().sequence
    newest(open_feed, open_feed.image.peek().sequence + 2)
    assert feed.image.peek().sequence == last


def test_each_feed_has_its_own_rate(cameras):
    fast, slow = cameras.subscribe("eye", 80, 60, 60.0), cameras.subscribe("behind", 80, 60, 6.0)
    newest(slow, 5)
    ratio = fast.image.peek().sequence / slow.image.peek().sequence
    assert 3.0 < ratio < 20.0


def test_thirty_pictures_a_second_are_thirty():
    """The schedule with invented time: a little lateness is made up for, a stall is not."""
    due, now, drawn = 0.0, 0.0, 0
    while now < 10.0:
        now = max(now, due) + 0.012
        due = next_due(due, 30.0, now)
        drawn += 1
    assert drawn / 10.0 >= 29.5
    assert next_due(1.0, 30.0, 5.0) == pytest.approx(5.0 - 1.0 / 30.0)


def test_what_cannot_be_drawn_is_refused_with_a_reason(cameras):
    with pytest.raises(ValueError, match=r"'nose'.*eye, behind"):
        cameras.subscribe("nose", 80, 60, 10.0)
    with pytest.raises(ValueError, match="largest picture is 640x480"):
        cameras.subscribe("eye", 1280, 960, 10.0)
    with pytest.raises(ValueError, match="rgb, depth"):
        cameras.subscribe("eye", 80, 60, 10.0, "infrared")
    with pytest.raises(ValueError, match="rate"):
        cameras.subscribe("eye", 80, 60, 0.0)
    with pytest.raises(ValueError, match=r"'poster'.*screen"):
        cameras.set_texture("poster", np.zeros((40, 64, 3), np.uint8))
    with pytest.raises(ValueError, match="40, 64, 3"):
        cameras.set_texture("screen", np.zeros((64, 40, 3), np.uint8))


def test_closed_cameras_say_so(world):
    cameras = Cameras(world)
    cameras.close()
    cameras.close()
    with pytest.raises(CamerasFailed, match="closed"):
        cameras.subscribe("eye", 80, 60, 10.0)


def test_missing_opengl_is_reported_at_the_first_subscription(world, monkeypatch):
    def broken(width: int, height: int) -> None:
        raise ImportError("no libEGL here")

    monkeypatch.setattr("telepresence.sim.painter.make_context", broken)
    cameras = Cameras(world)
    with pytest.raises(CamerasFailed, match="no libEGL here"):
        cameras.subscribe("eye", 80, 60, 10.0)
    cameras.close()
