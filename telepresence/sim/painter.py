"""Draws pictures of a world with OpenGL. Made, used and closed by one thread."""

from __future__ import annotations

import copy
import math
import os
from typing import Any, NamedTuple

import mujoco
import numpy as np

from telepresence.sim.world import World

MAX_GEOMS = 2000
"""Most geoms of one picture."""
_SHOWN, _HIDDEN = 0, 1  # geom groups of the painter's own model
STILL = 1e-4
"""What has moved by less [m], or turned by less [rad], is where it was: a sixth of a pixel at arm's length."""
_KEPT = 16
SKY_KEPT = 15
"""Pictures for which a camera that has seen the sky is taken to go on seeing it."""
CRACKS = 16
"""Points without anything that may stay black: between two walls that meet, some are neither's."""
_SAMPLED = 7
"""Every seventh point is looked at first: seven black ones in a row or, as usual widths are no multiple of seven, in a
column have one of these among them."""


class _Drawn(NamedTuple):
    """A picture, and where everything was that is in it."""

    pixels: np.ndarray
    shown: np.ndarray
    poses: np.ndarray


class Painter:
    """One OpenGL context with its own copy of the world's model and state.

    Geoms outside a camera's view are hidden before drawing: the renderer itself transforms every geom there is, and a
    robot's camera sees a small part of a flat. The copy of the model makes that possible without touching the groups
    that distance sensors rely on. Where nothing has moved since, the picture before is still right: a robot that stands
    in a quiet room costs next to nothing. The sky, a fifth of the cost of a picture, is painted only where some of it
    is seen, as indoors it is not.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._model = copy.copy(world.model)
        self._data = mujoco.MjData(self._model)
        limit = self._model.vis.global_
        self._gl = make_context(limit.offwidth, limit.offheight)
        self._gl.make_current()
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_150)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        _do_without_stencil(self._context)
        for texture in np.flatnonzero(self._model.tex_type == mujoco.mjtTexture.mjTEXTURE_2D):
            _filter_cheaply(int(self._context.texture[texture]))
        self._scene = mujoco.MjvScene(self._model, maxgeom=MAX_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0  # there is no stencil
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = 0
        self._option.geomgroup[_SHOWN] = 1
        self._option.sitegroup[:] = 0
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._drawn: dict[tuple, _Drawn] = {}
        self._has_sky = bool((self._model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX).any())
        self._sky_seen: dict[int, int] = {}
        """Camera -> for how many pictures it still needs the sky."""
        self._edges_of: dict[tuple[int, float], np.ndarray] = {}
        radii = self._model.geom_rbound
        self._radii = np.where(radii > 0.0, radii, np.inf)
        """Radius of the sphere around each geom [m]; a plane has no end."""

    def fit(self, width: int, height: int) -> None:
        """Make room for pictures of up to this size [px] and no larger ones.

        OpenGL clears all of its buffer before each picture, whatever the picture's size.
        """
        if (width, height) != (self._context.offWidth, self._context.offHeight):
            mujoco.mjr_resizeOffscreen(width, height, self._context)  # which makes another buffer
            _do_without_stencil(self._context)

    def close(self) -> None:
        """Free everything, on the thread that made it."""
        self._context.free()
        self._gl.free()

    def upload(self, textures: dict[int, np.ndarray]) -> None:
        """Change textures: index in the model -> pixels."""
        for texture, pixels in textures.items():
            start = self._model.tex_adr[texture]
            self._model.tex_data[start : start + pixels.size] = pixels.ravel()
            mujoco.mjr_uploadTexture(self._model, self._context, texture)  # which sets the filter, too
            _filter_cheaply(int(self._context.texture[texture]))
        if textures:
            self._drawn.clear()

    def snapshot(self) -> float:
        """Copy the present state; return its instant [s since 1970]."""
        with self._world.locked() as live:
            self._data.qpos[:] = live.qpos
            if self._model.nmocap:
                self._data.mocap_pos[:] = live.mocap_pos
                self._data.mocap_quat[:] = live.mocap_quat
            self._model.mat_rgba[:] = self._world.model.mat_rgba
            stamp = self._world.stamp
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        return stamp

    def sees(self, texture: int, camera: int, width: int, height: int) -> bool:
        """Return whether a surface with this texture may be in a camera's picture, as of the last `snapshot`."""
        return bool(self._in_view(camera, width / height)[self._textured(texture)].any())

    def draw(self, camera: int, width: int, height: int, kind: str) -> np.ndarray:
        """Return a picture of the world as of the last `snapshot`, which nobody may change: `(height, width, 3) uint8`;
        for "depth" `(height, width) float32`. It is the one before, when nothing in it has moved.

        Args:
            camera: Its index in the model.
        """
        view = (camera, width, height, kind)
        shown = self._in_view(camera, width / height)
        poses = self._poses(camera, shown)
        before = self._drawn.pop(view, None)
        if before is None or not np.array_equal(before.shown, shown) or not _still(before.poses, poses):
            before = _Drawn(self._paint(camera, shown, width, height, kind), shown, poses)
        self._drawn[view] = before
        if len(self._drawn) > _KEPT:
            del self._drawn[next(iter(self._drawn))]  # the one that has not been asked for the longest
        return before.pixels

    def _poses(self, camera: int, shown: np.ndarray) -> np.ndarray:
        """Return all numbers that a picture depends on, in metres and parts of one."""
        data = self._data
        numbers = (
            data.cam_xpos[camera], data.cam_xmat[camera], data.geom_xpos[shown], data.geom_xmat[shown],
            data.light_xpos, data.light_xdir, self._model.mat_rgba,
        )  # fmt: skip
        return np.concatenate([part.ravel() for part in numbers])

    def _paint(self, camera: int, shown: np.ndarray, width: int, height: int, kind: str) -> np.ndarray:
        self._camera.fixedcamid = camera
        self._model.geom_group[:] = np.where(shown, _SHOWN, _HIDDEN)
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, self._data, self._option, None, self._camera, everything, self._scene)
        area = mujoco.MjrRect(0, 0, width, height)
        if kind == "depth":
            return self._draw_depth(area)
        return _frozen(np.ascontiguousarray(self._draw_with_sky(camera, area)[::-1]))

    def _draw_with_sky(self, camera: int, area: mujoco.MjrRect) -> np.ndarray:
        left = self._sky_seen.pop(camera, 0)
        if left == 0:
            pixels = self._draw_colours(area, sky=False)
            if not (self._has_sky and _has_holes(pixels)):
                return pixels
            left = SKY_KEPT + 1
        self._sky_seen[camera] = left - 1
        return self._draw_colours(area, sky=True)

    def _draw_colours(self, area: mujoco.MjrRect, sky: bool) -> np.ndarray:
        """Return what the scene looks like, bottom row first; black where there is neither a geom nor the sky."""
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = sky
        mujoco.mjr_render(area, self._scene, self._context)
        pixels = np.empty((area.height, area.width, 3), np.uint8)
        mujoco.mjr_readPixels(pixels, None, area, self._context)
        return pixels

    def _textured(self, texture: int) -> np.ndarray:
        """Return which geoms have a texture, shape (ngeom,) bool."""
        materials = np.flatnonzero((self._model.mat_texid == texture).any(axis=1))
        return np.isin(self._model.geom_matid, materials)

    def _in_view(self, camera: int, aspect: float) -> np.ndarray:
        """Return which geoms' bounding spheres reach into the camera's field of view, shape (ngeom,) bool."""
        model, data = self._model, self._data
        if (
            model.cam_projection[camera] != mujoco.mjtProjection.mjPROJ_PERSPECTIVE
            or model.cam_sensorsize[camera].any()
        ):
            return np.ones(model.ngeom, bool)
        frame, edges = data.cam_xmat[camera].reshape(3, 3), self._edges(camera, aspect)
        beyond = (edges @ frame.T) @ (data.geom_xpos - data.cam_xpos[camera]).T
        return beyond.max(axis=0) < self._radii

    def _edges(self, camera: int, aspect: float) -> np.ndarray:
        """Return the normals of the four planes between which a camera sees, pointing out of its view, in its frame:
        x right, y up, looking along -z. Shape (4, 3)."""
        key = (camera, aspect)
        if key not in self._edges_of:
            half_y = math.radians(float(self._model.cam_fovy[camera])) / 2.0
            half_x = math.atan(aspect * math.tan(half_y))
            right, up = (math.cos(half_x), 0.0, math.sin(half_x)), (0.0, math.cos(half_y), math.sin(half_y))
            self._edges_of[key] = np.array([right, up, np.multiply(right, (-1, 1, 1)), np.multiply(up, (1, -1, 1))])
        return self._edges_of[key]

    def _draw_depth(self, area: mujoco.MjrRect) -> np.ndarray:
        flags = self._scene.flags
        flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = 1
        mujoco.mjr_render(area, self._scene, self._context)
        flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = 0
        depth = np.empty((area.height, area.width), np.float32)
        mujoco.mjr_readPixels(None, depth, area, self._context)
        # Reversed depth buffer (0 far, 1 near): z = near * far / (near + buffer * (far - near)).
        extent = self._model.stat.extent
        near, far = self._model.vis.map.znear * extent, self._model.vis.map.zfar * extent
        return _frozen((near * far / (near + depth[::-1].astype(np.float64) * (far - near))).astype(np.float32))


def _do_without_stencil(context: mujoco.MjrContext) -> None:
    """Give the picture's buffer a depth of 4 bytes a point instead of depth and stencil of 8: a tenth to a fifth of the
    cost of a picture. MuJoCo needs the stencil for mirrors, and no scene has any."""
    # Not at the top: see `_filter_cheaply`.
    from OpenGL.raw.GL.VERSION.GL_3_0 import (
        GL_DEPTH_ATTACHMENT,
        GL_DEPTH_COMPONENT32F,
        GL_DEPTH_STENCIL_ATTACHMENT,
        GL_FRAMEBUFFER,
        GL_RENDERBUFFER,
        glBindFramebuffer,
        glBindRenderbuffer,
        glFramebufferRenderbuffer,
        glRenderbufferStorage,
    )

    depth = context.offDepthStencil
    glBindFramebuffer(GL_FRAMEBUFFER, context.offFBO)
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, 0)
    glBindRenderbuffer(GL_RENDERBUFFER, depth)
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, context.offWidth, context.offHeight)
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth)


def _filter_cheaply(texture: int) -> None:
    """Take the points of an OpenGL texture from the one copy of it whose size fits best, not from two: a twentieth of
    the cost of a picture, and nobody sees the difference."""
    # Not at the top: PyOpenGL decides at its first import for which kind of context it works; MuJoCo tells it.
    from OpenGL.raw.GL.VERSION.GL_1_1 import (
        GL_LINEAR_MIPMAP_NEAREST,
        GL_TEXTURE_2D,
        GL_TEXTURE_MIN_FILTER,
        glBindTexture,
        glTexParameteri,
    )

    glBindTexture(GL_TEXTURE_2D, texture)
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST)


def _still(before: np.ndarray, now: np.ndarray) -> bool:
    """Return whether nothing has moved; what is at no place any more (NaN) has."""
    return bool(np.abs(before - now).max() <= STILL)


def _has_holes(pixels: np.ndarray) -> bool:
    """Return whether more than a crack is as black as nothing at all."""
    red, green, blue = pixels.reshape(-1, 3).T
    return bool(red[::_SAMPLED].min() == 0 and np.count_nonzero(red | green | blue) < red.size - CRACKS)


def _frozen(pixels: np.ndarray) -> np.ndarray:
    """Make a picture read-only, because several feeds share it."""
    pixels.flags.writeable = False
    return pixels


def make_context(width: int, height: int) -> Any:
    """Make an OpenGL context of the kind that MUJOCO_GL names, even if that was set after `mujoco` was imported."""
    if os.environ.get("MUJOCO_GL", "").lower() == "egl":
        from mujoco.egl import GLContext
    else:
        GLContext = mujoco.GLContext
    return GLContext(width, height)
