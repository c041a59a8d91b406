"""ALVideoDevice over the wire: the container, colours, rates, limits."""

import itertools
import time

import cv2
import numpy as np
import pytest
from naoqi_clients import connected

from pepper_sim.services.al_video_device import MAX_INSTANCES
from pepper_sim.simulation import Simulation

TOP, BOTTOM, DEPTH = 0, 1, 2
QQVGA, QVGA, VGA, VGA4, VGA16 = 0, 1, 2, 3, 4
YUV422, RGB, BGR, KDEPTH, XYZ, INFRARED, DISTANCE, RAW_DEPTH = 9, 11, 13, 17, 19, 20, 21, 23


@pytest.fixture
def video(naoqi):
    device = naoqi.ALVideoDevice
    yield device
    for handle in device.getSubscribers():
        device.unsubscribe(handle)


def _image(video, *arguments, name="test"):
    handle = video.subscribeCamera(name, *arguments)
    assert handle
    return video.getImageRemote(handle)


def test_the_container_is_a_list_with_raw_pixels(video):
    image = _image(video, TOP, VGA, RGB, 30)
    assert isinstance(image, list) and len(image) == 12
    width, height, layers, space, seconds, microseconds, pixels, camera, left, top, right, bottom = image
    assert (width, height, layers, space, camera) == (640, 480, 3, RGB, TOP)
    assert isinstance(pixels, bytearray) and len(pixels) == 640 * 480 * 3
    assert abs(seconds + microseconds * 1e-6 - time.time()) < 5.0
    assert left == -right > 0 and top == -bottom > 0
    assert left == pytest.approx(video.getHorizontalFOV(TOP) / 2, rel=1e-5)
    assert top == pytest.approx(video.getVerticalFOV(TOP) / 2, rel=1e-5)


@pytest.mark.parametrize(
    ("camera", "space", "layers"),
    [
        *((TOP, space, 1) for space in range(9)),
        *((BOTTOM, space, layers) for space, layers in ((9, 2), (10, 3), (11, 3), (12, 3), (13, 3), (14, 2), (15, 3))),
        (TOP, 18, 4),
        *((DEPTH, space, layers) for space, layers in ((0, 1), (11, 3), (17, 2), (19, 12), (20, 2), (21, 2), (23, 2))),
    ],
)
def test_every_colour_space_has_its_size(video, camera, space, layers):
    image = _image(video, camera, QVGA, space, 15)
    assert image[2:4] == [layers, space] and len(image[6]) == 320 * 240 * layers


def test_colour_spaces_show_the_same_picture(video):
    handle = video.subscribeCamera("test", TOP, QVGA, RGB, 15)
    rgb = np.frombuffer(video.getImageRemote(handle)[6], np.uint8).reshape(240, 320, 3)
    video.setColorSpace(handle, BGR)
    bgr = np.frombuffer(video.getImageRemote(handle)[6], np.uint8).reshape(240, 320, 3)
    video.setColorSpace(handle, YUV422)
    yuyv = np.frombuffer(video.getImageRemote(handle)[6], np.uint8).reshape(240, 320, 2)
    assert np.abs(rgb.astype(int) - bgr[:, :, ::-1]).mean() < 1.0
    decoded = cv2.cvtColor(yuyv, cv2.COLOR_YUV2RGB_YUYV)
    assert np.abs(rgb.astype(int) - decoded).mean() < 3.0
    assert rgb.std() > 5.0, "the picture shows something"


def test_depth_is_in_millimetres_and_points_agree_with_it(video):
    handle = video.subscribeCamera("test", DEPTH, QVGA, KDEPTH, 15)
    depth = np.frombuffer(video.getImageRemote(handle)[6], "<u2").reshape(240, 320)
    video.setColorSpace(handle, XYZ)
    points = np.frombuffer(video.getImageRemote(handle)[6], "<f4").reshape(240, 320, 3)
    video.setColorSpace(handle, DISTANCE)
    distance = np.frombuffer(video.getImageRemote(handle)[6], "<u2").reshape(240, 320)
    seen = (depth > 0) & (distance > 0) & (points[:, :, 0] > 0)
    assert seen.any() and depth[seen].min() >= 400 and depth[seen].max() <= 8000
    difference = np.abs(points[seen][:, 0] * 1000 - depth[seen])
    assert np.median(difference) < 5
    lengths = np.linalg.norm(points[seen], axis=1) * 1000
    assert np.median(np.abs(lengths - distance[seen])) < 5


def test_pictures_come_at_the_asked_rate_each_one_new(video):
    handle = video.subscribeCamera("test", TOP, VGA, RGB, 30)
    video.getImageRemote(handle)
    stamps, begin = [], time.monotonic()
    for _ in range(45):
        image = video.getImageRemote(handle)
        stamps.append(image[4] + image[5] * 1e-6)
    rate = 45 / (time.monotonic() - begin)
    assert stamps == sorted(stamps) and rate < 33.0
    # On a machine with other work some are drawn later than they should be, or twice of a world that has not gone on.
    assert len(set(stamps)) > 40
    assert min(after - before for before, after in itertools.pairwise(sorted({*stamps}))) < 1.5 / 30


def test_a_client_that_asks_for_hundreds_of_pictures_at_once_holds_up_itself(video, connect):
    greedy = connect().service("ALVideoDevice")
    handle = greedy.subscribeCamera("greedy", TOP, VGA, RGB, 4)
    calls = [greedy.getImageRemote(handle, _async=True) for _ in range(200)]
    assert _image(video, TOP, QQVGA, RGB, 30)[0] == 160
    assert greedy.unsubscribe(handle) is True, "which ends what waits"
    errors = [call.error(30_000) for call in calls if call.hasError(30_000)]
    assert len(errors) > 100 and set(errors) == {
        "\tALVideoDevice::getImageRemote\n\t64 calls wait for pictures of this subscription already"
    }


def test_two_clients_at_two_sizes(video, connect):
    other = connect().service("ALVideoDevice")
    small = other.subscribeCamera("small", BOTTOM, QQVGA, RGB, 10)
    assert len(_image(video, TOP, VGA, BGR, 10)[6]) == 640 * 480 * 3
    assert len(other.getImageRemote(small)[6]) == 160 * 120 * 3


def test_names_are_made_unique_up_to_a_limit(video):
    handles = [video.subscribeCamera("same", TOP, QVGA, RGB, 5) for _ in range(MAX_INSTANCES + 1)]
    assert handles == [*(f"same_{n}" for n in range(MAX_INSTANCES)), ""]
    assert set(video.getSubscribers()) == set(handles[:-1])
    assert video.unsubscribe("same_3") is True and video.unsubscribe("same_3") is False
    assert video.subscribeCamera("same", TOP, QVGA, RGB, 5) == "same_3"
    assert video.unsubscribe("same") is False and len(video.getSubscribers()) == MAX_INSTANCES, "a name is no handle"
    assert video.unsubscribeAllInstances("same") is True
    assert video.getSubscribers() == []


def test_impossible_subscriptions_have_an_empty_handle(video):
    for arguments in (
        (9, QVGA, RGB, 5),
        (TOP, 99, RGB, 5),
        (TOP, QVGA, KDEPTH, 5),
        (DEPTH, QVGA, YUV422, 5),
        (TOP, 1, 11, 0),
    ):
        assert video.subscribeCamera("bad", *arguments) == ""
    assert video.subscribeCamera("", TOP, QVGA, RGB, 5) == ""


def test_an_unknown_handle_has_no_picture(video):
    assert video.getImageRemote("nobody") is None
    assert video.releaseImage("nobody") is False
    assert video.unsubscribe("nobody") is False


def test_the_old_form_uses_the_active_camera(video):
    video.setParam(18, BOTTOM)
    handle = video.subscribe("old", QVGA, RGB, 10)
    assert video.getImageRemote(handle)[7] == BOTTOM
    video.setParam(18, TOP)
    assert video.getActiveCamera() == TOP and video.getParam(18) == TOP
    assert video.getActiveCamera(handle) == BOTTOM


def test_several_cameras_under_one_handle(video, refused):
    handle = video.subscribeCameras("both", [TOP, BOTTOM], [QVGA, QQVGA], [RGB, BGR], 10)
    images = video.getImagesRemote(handle)
    assert [(i[0], i[3], i[7]) for i in images] == [(320, RGB, TOP), (160, BGR, BOTTOM)]
    assert video.releaseImages(handle) == [True, True]
    assert video.subscribeCameras("twice", [TOP, TOP], [QVGA, QVGA], [RGB, RGB], 10) == ""
    assert "same length" in refused(video.subscribeCameras, "bad", [TOP], [], [], 10)


def test_depth_comes_beside_a_large_picture(video):
    handle = video.subscribeCameras("both", [TOP, DEPTH], [VGA4, VGA4], [BGR, KDEPTH], 10)
    large, depth = video.getImagesRemote(handle)
    assert large[:2] == depth[:2] == [1280, 960]
    assert len(large[6]) == 1280 * 960 * 3 and len(depth[6]) == 1280 * 960 * 2
    assert np.frombuffer(depth[6], "<u2").max() > 400


def test_each_camera_of_a_subscription_can_be_changed(video, refused):
    handle = video.subscribeCameras("both", [TOP, DEPTH], [QVGA, QVGA], [RGB, KDEPTH], 10)
    assert video.setResolutions(handle, [QQVGA, 99]) == [True, False]
    assert video.getResolutions(handle) == [QQVGA, QVGA]
    assert video.setColorSpaces(handle, [BGR, RGB]) == [True, True] and video.getColorSpaces(handle) == [BGR, RGB]
    assert video.setColorSpaces(handle, [KDEPTH, INFRARED]) == [False, True]
    assert video.setActiveCameras(handle, [BOTTOM, TOP]) == [True, False]
    assert video.getActiveCameras(handle) == [BOTTOM, DEPTH]
    assert [(i[0], i[3], i[7]) for i in video.getImagesRemote(handle)] == [(160, BGR, BOTTOM), (320, INFRARED, DEPTH)]
    assert video.setCamerasParameter(handle, 7, [1, 0]) == [True, True]
    assert (
        video.getCamerasParameter(handle, 7) == [1, 0] == [video.getParameter(BOTTOM, 7), video.getParameter(DEPTH, 7)]
    )
    assert video.setCamerasParameterToDefault(handle, 7) == [True, True] and video.getParameter(BOTTOM, 7) == 0
    assert "each of 2 cameras" in refused(video.setResolutions, handle, [QVGA])


def test_a_subscription_can_be_changed(video, refused):
    handle = video.subscribeCamera("test", TOP, QVGA, RGB, 10)
    assert video.setResolution(handle, QQVGA) and video.setFrameRate(handle, 5) and video.setColorSpace(handle, BGR)
    assert (video.getResolution(handle), video.getFrameRate(handle), video.getColorSpace(handle)) == (QQVGA, 5, BGR)
    assert video.getImageRemote(handle)[:4] == [160, 120, 3, BGR]
    assert video.setActiveCamera(handle, BOTTOM) and video.getImageRemote(handle)[7] == BOTTOM
    assert "resolution" in refused(video.setResolution, handle, 99)
    assert "colorSpace" in refused(video.setColorSpace, handle, KDEPTH)
    assert "frameRate" in refused(video.setFrameRate, handle, 0)
    assert "nobody" in refused(video.setResolution, "nobody", QVGA)


@pytest.mark.parametrize(("head", "fastest"), [("1.8a", {VGA: 30, VGA4: 1, VGA16: 1}), ("1.8", {VGA4: 30, VGA16: 15})])
def test_the_largest_pictures_come_as_fast_as_the_head_can(qi, head, fastest):
    with Simulation(scene="empty", port=0, head=head) as running, connected(qi, running.url) as client:
        device = next(s for s in running.server.catalogue.services if s.name == "ALVideoDevice")
        video = client.service("ALVideoDevice")
        handle = video.subscribeCamera("test", TOP, VGA16, RGB, 30)
        assert video.getImageRemote(handle)[:2] == [2560, 1920]
        assert fastest[VGA16] in [rate for _, resolution, rate, *_ in device._streams._shared if resolution == VGA16], (
            "so are they drawn"
        )
        for resolution, rate in fastest.items():
            assert video.setResolution(handle, resolution) and video.getFrameRate(handle) == rate
        both = video.subscribeCameras("both", [TOP, BOTTOM], [VGA16, QVGA], [RGB, RGB], 10)
        assert video.getFrameRate(both) == min(10, fastest[VGA16])


def test_forgotten_subscriptions_stop_drawing_and_end(simulation, video, wait_until):
    device = next(s for s in simulation.server.catalogue.services if s.name == "ALVideoDevice")
    handle = video.subscribeCamera("forgotten", TOP, QVGA, RGB, 30)
    video.getImageRemote(handle)
    wait_until(lambda: not device._streams._shared, "nothing is drawn for a client that does not ask")
    assert video.getImageRemote(handle) is not None, "the next call draws again"
    device.forget_unused(0.0)
    assert video.getSubscribers() == []


def test_a_killed_client_does_not_disturb_others(video, connect):
    dying = connect()
    device = dying.service("ALVideoDevice")
    handle = device.subscribeCamera("dying", TOP, VGA, RGB, 30)
    calls = [device.getImageRemote(handle, _async=True) for _ in range(5)]
    dying.close()
    assert _image(video, TOP, QVGA, RGB, 10) is not None
    assert calls


def test_flips_turn_the_picture(video):
    handle = video.subscribeCamera("test", TOP, QVGA, 0, 15)
    upright = np.frombuffer(video.getImageRemote(handle)[6], np.uint8).reshape(240, 320)
    video.setParameter(TOP, 8, 1)
    flipped = np.frombuffer(video.getImageRemote(handle)[6], np.uint8).reshape(240, 320)
    video.setAllParametersToDefault(TOP)
    assert np.abs(upright.astype(int) - flipped[::-1]).mean() < 2.0 < np.abs(upright.astype(int) - flipped).mean()


def test_a_shut_camera_has_no_pictures(video):
    handle = video.subscribeCamera("test", TOP, QVGA, RGB, 10)
    assert video.closeCamera(TOP) and not video.isCameraOpen(TOP)
    assert video.getImageRemote(handle) is None
    assert video.openCamera(TOP) and video.getImageRemote(handle) is not None


def test_calls_for_the_robots_own_modules_are_refused(video, refused):
    assert "getImageRemote" in refused(video.getImageLocal, "x")
