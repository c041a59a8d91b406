from __future__ import annotations

import numpy as np
import pytest
import qi
from naoqi_driver.connection import Address, CallRefused, Connection
from pepper_sensors.camera import Camera, RobotClock, read_reply
from pepper_sensors.colour import BGR


def container(stamp: float = 12.25, width: int = 4, height: int = 2) -> tuple:
    seconds = int(stamp)
    pixels = bytes(range(width * height * 3))
    return (width, height, 3, BGR, seconds, round((stamp - seconds) * 1e6), pixels, 0, 0.5, 0.4, -0.5, -0.4)


class Video:
    """The part of ALVideoDevice that subscriptions need; three handles, as a real robot has only a few."""

    def __init__(self) -> None:
        self.subscribers: list[str] = []
        self.asked: list[tuple] = []
        self.stamp = 12.25

    def getSubscribers(self) -> list[str]:
        return list(self.subscribers)

    def subscribeCamera(self, name: str, camera: int, resolution: int, space: int, rate: int) -> str:
        self.asked.append((name, camera, resolution, space, rate))
        if len(self.subscribers) >= 3:
            return ""
        handle = next(handle for n in range(3) if (handle := f"{name}_{n}") not in self.subscribers)
        self.subscribers.append(handle)
        return handle

    def unsubscribe(self, handle: str) -> bool:
        self.subscribers.remove(handle)
        return True

    @qi.bind("(iiiiiiriffff)", ["m"])
    def getImageRemote(self, handle: str) -> tuple:
        if handle not in self.subscribers:
            raise ValueError(f"unknown handle {handle}")
        return container(self.stamp)


@pytest.fixture
def video(naoqi) -> Video:
    service = Video()
    naoqi.register("ALVideoDevice", service)
    return service


@pytest.fixture
def link(naoqi, video):
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as connection:
        assert connection.wait_connected(10)
        yield connection


def test_reply_becomes_a_picture():
    picture = read_reply(container(stamp=1700000000.25))
    assert picture.pixels.shape == (2, 4, 3)
    assert picture.pixels.ravel().tolist() == list(range(24))
    assert (picture.encoding, picture.stamp) == ("bgr8", pytest.approx(1700000000.25))
    assert picture.angles == (0.5, 0.4, -0.5, -0.4)


@pytest.mark.parametrize(
    ("reply", "complaint"),
    [(container()[:7], "12 elements"), ((*container()[:6], "text", *container()[7:]), "came as str")],
)
def test_what_is_no_picture_is_refused(reply, complaint):
    with pytest.raises(ValueError, match=complaint):
        read_reply(reply)


def test_grabs_through_the_wire(link, video):
    camera = Camera(link, "front", 0, 1, BGR, 15)
    picture = camera.grab()
    assert np.array_equal(picture.pixels.ravel(), np.arange(24))
    assert video.asked == [("front", 0, 1, BGR, 15)]
    assert camera.frame_id == "CameraTop_optical_frame"


def test_a_picture_is_delivered_once(link, video):
    camera = Camera(link, "front", 0, 1, BGR, 15)
    assert camera.grab() is not None
    assert camera.grab() is None
    video.stamp += 0.1
    assert camera.grab().stamp == pytest.approx(12.35)


def test_leftovers_of_our_name_are_removed_and_others_stay(link, video):
    video.subscribers[:] = ["front", "front_0", "front_2", "front_door", "front_door_0"]
    camera = Camera(link, "front", 0, 1, BGR, 15)
    camera.grab()
    assert video.subscribers == ["front_door", "front_door_0", "front_0"]


def test_no_handle_is_an_error_that_explains(link, video):
    video.subscribers[:] = ["a", "b", "c"]
    with pytest.raises(CallRefused, match="too many programs"):
        Camera(link, "front", 0, 1, BGR, 15).grab()


def test_close_gives_the_camera_back(link, video):
    camera = Camera(link, "front", 0, 1, BGR, 15)
    camera.grab()
    camera.close()
    assert video.subscribers == []


def test_subscribes_again_after_a_new_link(naoqi, video, make_connection, wait_until):
    wire = make_connection(naoqi.port)
    with Connection(Address.parse("127.0.0.1", wire.port)) as connection:
        assert connection.wait_connected(10)
        camera = Camera(connection, "front", 0, 1, BGR, 15)
        camera.grab()
        wire.cut()
        wait_until(lambda: connection.connections == 2, "connected again")
        video.stamp += 1
        assert camera.grab() is not None
    assert len(video.asked) == 2
    assert video.subscribers == ["front_0"]


def test_wrong_settings_are_refused_at_once(link):
    with pytest.raises(ValueError, match="no camera 7"):
        Camera(link, "front", 7, 1, BGR, 15)
    with pytest.raises(ValueError, match="colour space 99"):
        Camera(link, "front", 0, 1, 99, 15)


def test_stamps_of_an_agreeing_clock_stay():
    clock = RobotClock()
    assert clock.to_local(stamp=100.0, arrival=100.05) == 100.0
    assert clock.to_local(stamp=100.1, arrival=100.9) == 100.1


@pytest.mark.parametrize("offset", [-3600.0, -0.2, 3.0])
def test_stamps_of_a_wrong_clock_are_corrected_by_the_fastest_picture(offset):
    clock = RobotClock()
    for taken, delay in ((100.0, 0.10), (100.1, 0.03), (100.2, 0.30)):
        local = clock.to_local(stamp=taken - offset, arrival=taken + delay)
    assert local == pytest.approx(100.2 + 0.03, abs=1e-6)


@pytest.mark.parametrize("jump", [-3600.0, 3600.0])
def test_a_clock_that_is_set_counts_from_the_next_picture_on(jump):
    clock = RobotClock()
    clock.to_local(stamp=100.0, arrival=100.05)
    assert clock.to_local(stamp=100.1, arrival=100.15 + jump) == pytest.approx(100.15 + jump), "this machine's"
    assert clock.to_local(stamp=100.2 + jump, arrival=100.25 + jump) == pytest.approx(100.2 + jump), "the robot's too"
