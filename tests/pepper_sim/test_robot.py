"""Pepper as a whole: snapshots, falls, resets, touch, cameras. Physics is real, time is stepped."""

from __future__ import annotations

import dataclasses
import math
import threading

import numpy as np
import pytest

from pepper_sim.body.description import ENCODER_STEP
from pepper_sim.body.postures import STAND
from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from telepresence.sim.camera import Cameras
from telepresence.sim.scene import build_world


@pytest.fixture(name="pepper")
def _pepper():
    return Pepper(build_world("empty", [pepper_model()]), None)


def until(pepper: Pepper, future, seconds: float = 60.0) -> object:
    """Step until `future` is done and return its result."""
    for _ in range(round(seconds / 0.05)):
        if future.done():
            return future.result()
        pepper.world.step(10)
    raise AssertionError(f"not done after {seconds} simulated seconds")


def test_starts_awake_standing_and_still(pepper):
    pepper.world.step(100)
    now = pepper.snapshot()
    assert now.joint_positions == pytest.approx(dict(STAND), abs=2 * ENCODER_STEP)
    assert set(now.stiffness.values()) == {1.0}
    assert now.odometry == (0.0, 0.0, 0.0) and not now.moving and not now.fallen
    assert pepper.truth() == pytest.approx((0.0,) * 6, abs=2e-3)


def test_a_snapshot_is_frozen_and_made_once_per_tick(pepper):
    first = pepper.snapshot()
    assert pepper.snapshot() is first
    with pytest.raises(dataclasses.FrozenInstanceError):
        first.time = 1.0
    with pytest.raises(ValueError, match="read-only"):
        pepper.world.step(40)
        pepper.snapshot().laser["Front"][0, 0] = 1.0
    assert pepper.snapshot().time > first.time
    assert pepper.snapshot().stamp > first.stamp


def test_equal_seeds_give_equal_readings():
    readings = []
    for seed in (5, 5, 6):
        pepper = Pepper(build_world("empty", [pepper_model()], seed=seed), None)
        pepper.set_velocity(0.2, 0.0, 0.2)
        pepper.world.step(300)
        now = pepper.snapshot()
        readings.append((now.laser["Left"].tolist(), now.sonar, now.imu_base, now.odometry))
    assert readings[0] == readings[1]
    assert readings[0] != readings[2]


def test_the_inertial_sensors_feel_gravity_turning_and_acceleration(pepper):
    pepper.world.step(100)
    rest = pepper.snapshot()
    assert rest.imu_base.accel == pytest.approx((0.0, 0.0, 9.81), abs=0.15)
    pepper.set_velocity(0.3, 0.0, 0.0)
    pepper.world.step(100)
    assert pepper.snapshot().imu_base.accel[0] == pytest.approx(0.3, abs=0.15)
    pepper.set_velocity(0.0, 0.0, 0.8)
    pepper.world.step(400)
    turning = pepper.snapshot()
    assert turning.imu_base.gyro[2] == pytest.approx(0.8, abs=0.02)
    assert turning.imu_torso.gyro[2] == pytest.approx(0.8, abs=0.05)
    assert turning.imu_base.angles[2] == pytest.approx(pepper.truth()[5], abs=5e-3)


def test_the_torso_leans_with_the_hip(pepper):
    pepper.set_angles({"HipPitch": -0.4}, {"HipPitch": 1.0})
    pepper.world.step(400)
    assert pepper.snapshot().imu_torso.angles[1] == pytest.approx(0.4, abs=0.02)
    assert pepper.snapshot().imu_base.angles[1] == pytest.approx(0.0, abs=0.01)


def test_link_poses_follow_odometry_not_truth(pepper):
    until(pepper, pepper.move_to([(1.0, 0.5, 1.0)]))
    odometry = pepper.snapshot().odometry
    base, torso = pepper.link_pose("base_footprint"), pepper.link_pose("torso")
    assert base[:2, 3] == pytest.approx(odometry[:2])
    assert math.atan2(base[1, 0], base[0, 0]) == pytest.approx(odometry[2])
    assert base[:2, 3] != pytest.approx(pepper.truth()[:2], abs=1e-6)
    assert torso[2, 3] == pytest.approx(0.82, abs=0.01)
    assert np.linalg.det(torso[:3, :3]) == pytest.approx(1.0)
    with pytest.raises(ValueError, match=r"'tail'.*CameraTop_frame.*torso"):
        pepper.link_pose("tail")


def test_a_person_presses_what_can_be_pressed(pepper):
    pepper.press("FrontTactil", True)
    pepper.press("LeftBumper", True)
    pepper.world.step(10)
    assert pepper.snapshot().touch["FrontTactil"] and pepper.snapshot().bumpers["FrontLeft"]
    pepper.press("FrontTactil", False)
    pepper.press("LeftBumper", False)
    pepper.world.step(10)
    assert not any(pepper.snapshot().touch.values()) and not any(pepper.snapshot().bumpers.values())
    with pytest.raises(ValueError, match=r"'Nose'.*ChestButton.*BackBumper"):
        pepper.press("Nose", True)


def test_a_robot_that_lies_is_limp_and_refuses_to_drive_until_the_reset(pepper):
    pepper.world.step(10)
    with pepper.world.locked() as data:
        data.qvel[4] = 6.0
    pepper.world.step(600)
    assert pepper.snapshot().fallen
    assert set(pepper.snapshot().stiffness.values()) == {0.0}
    assert until(pepper, pepper.move_to([(1.0, 0.0, 0.0)])) is False
    failure = pepper.snapshot().move_failed
    assert (failure.cause, failure.started) == ("fallen", False)
    pepper.world.reset()
    pepper.world.step(20)
    assert not pepper.snapshot().fallen
    assert pepper.truth() == pytest.approx((0.0,) * 6, abs=2e-3)


def test_a_velocity_is_replaced_only_while_nobody_has_commanded_since(pepper):
    first = pepper.set_velocity(0.1, 0.0, 0.0)
    second = pepper.replace_velocity(first, 0.2, 0.0, 0.0)
    assert second is pepper.newest_command
    assert pepper.replace_velocity(first, 0.0, 0.0, 0.0) is None
    pepper.world.step(200)
    assert pepper.snapshot().velocity[0] == pytest.approx(0.2, abs=0.01)
    pepper.stop_move()
    assert pepper.replace_velocity(second, 0.2, 0.0, 0.0) is None


def test_a_reset_ends_everything_and_lets_everybody_know(pepper):
    move = pepper.move_to([(2.0, 0.0, 0.0)])
    gesture = pepper.follow({"HeadYaw": [(5.0, 1.0)]})
    pepper.press("ChestButton", True)
    pepper.world.step(200)
    pepper.world.reset()
    pepper.world.step(1)
    assert move.result(0) is False and gesture.result(0) is False
    now = pepper.snapshot()
    assert now.odometry == (0.0, 0.0, 0.0) and not now.moving and not now.touch["ChestButton"]
    pepper.world.step(200)
    assert pepper.truth()[:2] == pytest.approx((0.0, 0.0), abs=1e-3)
    assert pepper.snapshot().joint_positions["HeadYaw"] == pytest.approx(STAND["HeadYaw"], abs=0.01)


def test_closing_the_world_leaves_nobody_waiting(pepper):
    move, gesture = pepper.move_to([(2.0, 0.0, 0.0)]), pepper.follow({"HeadYaw": [(5.0, 1.0)]})
    pepper.world.step(10)
    stop = pepper.stop_move()
    pepper.world.close()
    assert (move.result(0), gesture.result(0), stop.result(0)) == (False, False, True)


def test_futures_are_completed_outside_the_lock(pepper):
    """A completion callback that needs another thread to use the robot must not block the world."""
    answers: list[bool] = []

    def ask(_: object) -> None:
        done = threading.Event()
        threading.Thread(target=lambda: (pepper.snapshot(), done.set())).start()
        answers.append(done.wait(5.0))

    pepper.move_to([(0.05, 0.0, 0.0)]).add_done_callback(ask)
    pepper.follow({"HeadYaw": [(0.2, 0.1)]}).add_done_callback(ask)
    pepper.stop_move().add_done_callback(ask)
    pepper.world.step(200)
    assert answers == [True, True, True]


def test_two_peppers_share_a_world_and_see_each_other():
    world = build_world("empty", [pepper_model("a/"), pepper_model("b/", offset=(1.5, 0.0))])
    first, second = Pepper(world, None, "a/"), Pepper(world, None, "b/")
    second.set_velocity(0.2, 0.0, 0.0)
    world.step(200)
    assert first.truth()[0] == pytest.approx(0.0, abs=1e-3)
    assert second.truth()[0] > 1.6
    assert second.snapshot().odometry[0] == pytest.approx(second.truth()[0] - 1.5, abs=0.01)
    straight_ahead = first.snapshot().laser["Front"][7, 0]
    assert straight_ahead == pytest.approx(second.truth()[0] - 0.255 - 0.0562, abs=0.08)


def test_a_pepper_without_cameras_is_blind_and_says_so(pepper):
    pepper.show_on_tablet(None)
    with pytest.raises(RuntimeError, match="without cameras"):
        pepper.subscribe_camera("CameraTop", 320, 240, 10.0)
    with pytest.raises(ValueError, match=r"'CameraNose'.*CameraTop, CameraBottom, CameraDepth"):
        pepper.subscribe_camera("CameraNose", 320, 240, 10.0)


def test_the_cameras_see_the_room_and_not_the_inside_of_the_head():
    world = build_world("empty", [pepper_model()])
    cameras = Cameras(world)
    try:
        pepper = Pepper(world, cameras)
        pepper.set_angles({"HeadPitch": 0.0}, {})
        world.step(200)
        feeds = [pepper.subscribe_camera(name, 160, 120, 10.0, "depth") for name in ("CameraTop", "CameraDepth")]
        for feed in feeds:
            depth = feed.image.wait_newer(0, 20.0).content
            assert depth.min() > 0.5, feed.camera
            # The wall is 4 m ahead and 1.2 m high; below the horizon nothing is nearer than the floor.
            assert depth[61, 80] == pytest.approx(4.0, abs=0.1), feed.camera
    finally:
        cameras.close()


def test_lights_take_a_colour(pepper):
    pepper.lights.colour("eyes", 1.0, 0.0, 2.0)
    assert pepper.world.model.material("pepper/eyes").rgba == pytest.approx((1.0, 0.0, 1.0, 1.0))
    with pytest.raises(ValueError, match=r"'knee'.*eyes, shoulders"):
        pepper.lights.colour("knee", 1.0, 1.0, 1.0)


def test_the_tablet_shows_what_it_is_given():
    world = build_world("empty", [pepper_model("a/"), pepper_model("b/", offset=(-1.2, 0.0))])
    cameras = Cameras(world)
    try:
        shown, watcher = Pepper(world, cameras, "a/"), Pepper(world, cameras, "b/")
        shown.move_to([(0.0, 0.0, math.pi)])
        watcher.set_angles({"HeadPitch": 0.1}, {})
        world.step(1600)
        feed = watcher.subscribe_camera("CameraTop", 320, 240, 30.0)
        dark = feed.image.wait_newer(0, 20.0)
        picture = np.zeros((400, 640, 3), np.uint8)
        picture[:] = (255, 0, 255)
        shown.show_on_tablet(picture)
        purple, sequence = 0, dark.sequence
        while purple == 0 and sequence < 200:
            newest = feed.image.wait_newer(sequence, 20.0)
            sequence = newest.sequence
            red, green, blue = (newest.content[:, :, i].astype(int) for i in range(3))
            purple = int(((red - green > 80) & (blue - green > 80)).sum())
        assert purple > 300
        with pytest.raises(ValueError, match="400, 640, 3"):
            shown.show_on_tablet(np.zeros((800, 1280, 3), np.uint8))
    finally:
        cameras.close()
