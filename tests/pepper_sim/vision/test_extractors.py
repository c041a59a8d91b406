"""What the extractors find in the picture of a robot before which posters stand; what they cost when nobody asks."""

import threading
import time

import cv2
import numpy as np
import pytest

from pepper_sim.services.al_backlighting_detection import backlighting
from pepper_sim.services.al_photo_capture import MAX_SERIES


@pytest.fixture
def looking(naoqi):
    """Subscribe to an extractor until the test ends, ten times a second."""
    subscribed = []

    def subscribe(name):
        service = getattr(naoqi, name)
        service.subscribe("test", 100, 0.5)
        subscribed.append(service)
        return service

    yield subscribe
    for service in subscribed:
        service.unsubscribe("test")


@pytest.fixture
def value(naoqi, wait_until):
    """Wait for a new value of a key of the memory and return it."""

    def wait(key):
        naoqi.ALMemory.insertData(key, None)
        found = wait_until(lambda: [naoqi.ALMemory.getData(key)] != [None] and [naoqi.ALMemory.getData(key)], key)
        return found[0]

    return wait


@pytest.fixture
def carry(simulation):
    """Carry the poster of this number somewhere; the next restart of the world brings it back."""

    def put(number, place):
        body = simulation.world.model.body(f"pepper/poster_{number}")
        with simulation.world.locked() as data:
            data.mocap_pos[body.mocapid[0]] = place

    return put


def test_nobody_looks_unless_somebody_has_subscribed(naoqi, looking, wait_until):
    streams = naoqi.simulation.server.catalogue._parts  # no feed is drawn for a service that only exists
    video = next(part for kind, part in streams.items() if kind.__name__ == "ALVideoDevice")
    assert "ALRedBallDetection" not in [thread.name for thread in threading.enumerate()]
    wait_until(lambda: not video._streams._shared, "no camera is drawn")
    detection = looking("ALRedBallDetection")
    wait_until(lambda: len(video._streams._shared) == 1, "a camera is drawn")
    assert "ALRedBallDetection" in [thread.name for thread in threading.enumerate()]
    detection.unsubscribe("test")
    wait_until(lambda: "ALRedBallDetection" not in [t.name for t in threading.enumerate()], "its thread has ended")


def test_an_extractor_starts_by_itself_when_a_module_subscribes_to_its_event(naoqi, session, wait_until):
    calls = []

    class Module:
        def on_ball(self, key, value, message):
            calls.append((key, len(value), message))

    registered = session.registerService("BallModule", Module())
    try:
        naoqi.ALMemory.subscribeToEvent("redBallDetected", "BallModule", "on_ball")
        wait_until(lambda: calls, "the module was called")
        assert calls[0] == ("redBallDetected", 5, "BallModule")
        assert [info[0] for info in naoqi.ALRedBallDetection.getSubscribersInfo()] == ["BallModule"]
        naoqi.ALMemory.unsubscribeToEvent("redBallDetected", "BallModule")
        assert naoqi.ALRedBallDetection.getSubscribersInfo() == []
    finally:
        session.unregisterService(registered)


def test_a_paused_extractor_raises_nothing(naoqi, looking, value):
    detection = looking("ALDarknessDetection")
    assert 0 <= value("DarknessDetection/DarknessValue") <= 100
    detection.pause(True)

    def raises_nothing():
        naoqi.ALMemory.insertData("DarknessDetection/DarknessValue", None)
        time.sleep(0.3)  # in which it may raise nothing
        return naoqi.ALMemory.getData("DarknessDetection/DarknessValue") is None

    # The first times the look that was under way may not have ended.
    assert any(raises_nothing() for _ in range(4)) and detection.isProcessing()
    detection.pause(False)
    assert value("DarknessDetection/DarknessValue") is not None


def test_it_is_dark_where_the_picture_is_darker_than_the_threshold(naoqi, looking, value, wait_until):
    detection = looking("ALDarknessDetection")
    assert 0 < value("DarknessDetection/DarknessValue") < detection.getDarknessThreshold() == 60, "a room by day"
    raised = []
    subscriber = naoqi.ALMemory.subscriber("DarknessDetection/DarknessDetected")
    subscriber.signal.connect(raised.append)
    detection.setDarknessThreshold(-5)
    assert detection.getDarknessThreshold() == 0
    wait_until(lambda: raised, "it counts as dark")
    value("DarknessDetection/DarknessValue")
    assert len(raised) == 1, "once, as long as it stays dark"
    detection.setDarknessThreshold(60)


@pytest.mark.parametrize(("bright", "dark", "expected"), [(5, 70, 2), (5, 40, 1), (1, 70, 0), (5, 20, 0)])
def test_backlighting_is_a_bright_part_before_a_dark_one(bright, dark, expected):
    grey = np.full(10000, 128, np.uint8)
    grey[: 100 * bright], grey[-100 * dark :] = 255, 20
    assert backlighting(grey) == expected


def test_backlighting_is_measured_in_the_picture(looking, value):
    looking("ALBacklightingDetection")
    assert value("BacklightingDetection/BacklightingValue") in (0, 1, 2)


def test_a_red_ball_is_seen_where_it_is(looking, value):
    looking("ALRedBallDetection")
    stamp, (x, y, width, height), _, robot, camera = value("redBallDetected")
    assert abs(stamp[0] + stamp[1] * 1e-6 - time.time()) < 5.0 and camera == 0
    ahead, left = 1.5 - robot[0], -0.6 - robot[1]
    assert x == pytest.approx(np.arctan2(left, ahead), abs=0.03)
    assert y + robot[4] == pytest.approx(np.arctan2(robot[2] - 1.6, np.hypot(ahead, left)), abs=0.04)
    assert width == pytest.approx(height, rel=0.25) and width == pytest.approx(0.1 / np.hypot(ahead, left), rel=0.2)


def test_a_blob_of_a_colour_is_seen_where_it_is(naoqi, looking, value, wait_until):
    detection = naoqi.ALColorBlobDetection
    detection.setColor(220, 20, 20, 60)
    detection.setObjectProperties(50, 0.2, "Circle")
    looking("ALColorBlobDetection")
    _, in_robot, _, effector = value("ALTracker/ColorBlobDetected")
    assert in_robot[:3] == pytest.approx((1.5, -0.6, 1.6), abs=0.12) and effector == 1
    x, y, radius = detection.getCircle()
    assert 0.75 < x < 0.95 and 0.2 < y < 0.5 and 0.02 < radius < 0.1
    detection.setColor(0, 255, 0, 10)
    wait_until(lambda: detection.getCircle() == [], "there is nothing green")
    assert detection.getAutoExposure() is True


def test_what_moves_is_seen_in_depth(naoqi, looking, value, carry, wait_until):
    detection = looking("ALMovementDetection")
    assert detection.setActiveCamera(2) and value("MovementDetection/NoMovement") == 1
    naoqi.ALMemory.insertData("MovementDetection/MovementInfo", None)
    places = iter([(0.8 + 0.2 * (n % 2), 0.0, 1.3) for n in range(200)])

    def moved():
        carry(3, next(places))
        time.sleep(0.1)
        return naoqi.ALMemory.getData("MovementDetection/MovementInfo")

    _, clusters, _, _, camera = wait_until(moved, "movement was detected")
    assert camera == 2
    centre, box, shares, distance, size, top = clusters[0]
    assert abs(centre[0]) < 0.3 and len(box) == 4 and 0 < shares[0] < shares[1] <= 1.0
    assert 0.5 < distance < 1.5 and 0.02 < size[0] < 1.0 and top[1] <= centre[1]


def test_what_is_too_close_is_seen_in_infrared_light(naoqi, looking, value, carry):
    looking("ALCloseObjectDetection")
    carry(3, (0.3, 0.0, 1.2))
    assert value("CloseObjectDetection/ObjectDetected") == 1
    _, (centre, _, shares), *_ = naoqi.ALMemory.getData("CloseObjectDetection/ObjectInfo")
    assert len(centre) == 2 and 0.0 < shares[0] <= 1.0
    carry(3, (1.5, 0.55, 1.65))
    assert value("CloseObjectDetection/ObjectNotDetected") == 1


def test_the_depth_picture_is_cut_into_objects(naoqi, looking, value):
    segmentation = naoqi.ALSegmentation3D
    nearest = segmentation.getTopOfBlob(-1.0, 2, False)
    assert 0.7 < nearest[0] < 2.0
    yaw, pitch, distance = segmentation.getTopOfBlob(-1.0, -1, False)
    assert abs(yaw) < 0.6 and abs(pitch) < 0.5 and 0.7 < distance < 2.0
    assert segmentation.getTopOfBlob(60.0, 2, False) == []
    looking("ALSegmentation3D")
    segmentation.setBlobTrackingDistance(-1.0)
    segmentation.setBlobTrackingEnabled(True)
    _, in_robot, _, _ = value("ALTracker/BlobDetected")
    assert in_robot[:3] == pytest.approx(nearest, abs=0.2)
    _, blobs, *_ = naoqi.ALMemory.getData("Segmentation3D/BlobsList")
    assert min(blob[2] for blob in blobs) == pytest.approx(distance, abs=0.1)
    segmentation.setBlobTrackingEnabled(False)


def test_a_learned_picture_is_recognised(naoqi, looking, value, picture):
    recognition, disk = naoqi.ALVisionRecognition, naoqi.simulation.server.catalogue.disk
    cv2.imwrite(str(disk.path("/home/nao/book.png")), picture)
    recognition.clearCurrentDatabase()
    assert recognition.learnFromFile("/home/nao/book.png", "book", ["shelf"], True, False) is True
    assert recognition.learnFromFile("/home/nao/book.png", "book", [], True, False) is False, "it is known"
    assert recognition.learnFromFile("/home/nao/nothing.png", "nothing", [], True, False) is False
    looking("ALVisionRecognition")
    _, ((labels, matches, ratio, corners),) = value("PictureDetected")
    assert labels == ["book", "shelf"] and matches >= 12 and 0.0 < ratio <= 1.0
    assert np.mean([corner[0] for corner in corners]) == pytest.approx(np.arctan2(0.55, 1.5), abs=0.1)
    assert recognition.changeDatabase("", "other") and recognition.getSize() == 0
    assert recognition.changeDatabase("", "") and recognition.getSize() == 1, "it was kept on the disk"
    recognition.clearCurrentDatabase()
    assert recognition.getSize() == 0


def test_a_database_is_cleared_without_what_lies_beside_it(naoqi, picture, refused):
    recognition, disk = naoqi.ALVisionRecognition, naoqi.simulation.server.catalogue.disk
    neighbour = disk.path("/home/nao/book.png")
    cv2.imwrite(str(neighbour), picture)
    assert recognition.changeDatabase("/home", "nao")
    assert recognition.learnFromFile("/home/nao/book.png", "book", [], True, False)
    recognition.clearCurrentDatabase()
    assert neighbour.is_file() and recognition.getSize() == 0
    assert not [*disk.path("/home/nao").glob("*.json")], "its own files are gone"
    for name in (".", ".."):
        assert "databaseName" in refused(recognition.changeDatabase, "/", name)
    assert recognition.changeDatabase("", "")


def test_a_picture_that_is_learned_again_takes_no_other_one_s_place(naoqi, picture, wait_until):
    recognition, disk = naoqi.ALVisionRecognition, naoqi.simulation.server.catalogue.disk
    for name, pixels in (("book", picture), ("map", cv2.flip(picture, 1))):
        cv2.imwrite(str(disk.path(f"/home/nao/{name}.png")), pixels)
        assert recognition.learnFromFile(f"/home/nao/{name}.png", name, [], True, False)
    assert recognition.learnFromFile("/home/nao/book.png", "book", [], True, True)
    assert recognition.changeDatabase("", "other") and recognition.changeDatabase("", ""), "it is read from the disk"
    found = naoqi.ALMemory.subscriber("PictureDetected")
    heard = []
    found.signal.connect(heard.append)
    recognition.detectFromFile("/home/nao/map.png")
    recognition.clearCurrentDatabase()
    wait_until(lambda: heard, "it was found")
    assert heard[0][1][0][0] == ["map"]


def test_directions_are_remembered(naoqi, looking, value):
    history = looking("ALVisualSpaceHistory")
    history.setGridPrecision(2.0)
    cells = value("VisualSpaceHistory/VisualGrid/Data")
    stamps = [seconds + microseconds * 1e-6 for _, (seconds, microseconds) in cells]
    assert stamps == sorted(stamps) and abs(cells[-1][0][0]) < 0.5, "the newest one is straight ahead"
    assert abs(cells[0][0][0]) > 0.5, "the oldest one is not"


def test_a_series_goes_on_only_over_what_may_be_overwritten(naoqi, refused):
    camera = naoqi.ALPhotoCapture
    folder = "/home/nao/recordings"
    assert camera.takePicture(folder, "one") == [f"{folder}/one.jpg"]
    assert "exists already" in refused(camera.takePicture, folder, "one.jpg", False)
    assert camera.takePictures(1, folder, "one") == [[f"{folder}/one_0.jpg"]]
    assert "exists already" in refused(camera.takePictures, 2, folder, "one", False)
    assert "'..'" in refused(camera.takePicture, "/home/nao/../..", "one")
    camera.setCaptureInterval(20)
    calls = [camera.takePictures(2, folder, f"many{number}", _async=True) for number in range(20)]
    answers = [call.error() if call.wait(30000) and call.hasError() else call.value() for call in calls]
    refusals = [answer for answer in answers if "wait for the camera already" in str(answer)]
    assert 0 < len(refusals) < 20 and all(len(answer[0]) == 2 for answer in answers if answer not in refusals)
    camera.setCaptureInterval(200)
    assert naoqi.ALVideoDevice.closeCamera(0)
    assert "no picture" in refused(camera.takePicture, folder, "two")
    naoqi.ALVideoDevice.openCamera(0)


def test_a_slow_series_leaves_the_camera_to_others_and_ends_with_its_caller(naoqi, connect, refused, wait_until):
    camera, folder, client = naoqi.ALPhotoCapture, "/home/nao/slow", connect()
    hourly = client.service("ALPhotoCapture")
    hourly.setCaptureInterval(3_600_000)

    def photographed():
        call = camera.takePicture(folder, "mine", _async=True)
        call.wait(10_000)
        assert call.isFinished(), "a picture waits for the series of others"
        return not call.hasError()

    series = [hourly.takePictures(3, folder, f"slow{number}", _async=True) for number in range(MAX_SERIES)]
    disk = naoqi.simulation.server.catalogue.disk
    wait_until(lambda: len([*disk.path(folder).glob("slow*_0.jpg")]) == MAX_SERIES, "each has its first picture")
    assert "already" in refused(camera.takePicture, folder, "mine")
    series[0].cancel()
    wait_until(photographed, "a cancelled series has left its place")
    series[0] = hourly.takePictures(3, folder, "once_more", _async=True)
    wait_until(lambda: disk.path(f"{folder}/once_more_0.jpg").exists(), "it has its first picture")
    assert not photographed()
    client.close()
    wait_until(photographed, "those of a client that is gone have left theirs")
    camera.setCaptureInterval(200)


def test_one_film_at_a_time_and_in_the_formats_of_the_robot(naoqi, refused):
    recorder = naoqi.ALVideoRecorder
    assert "no video" in refused(recorder.stopRecording)
    recorder.setVideoFormat("IYUV")
    recorder.setColorSpace(0)
    assert "colour" in refused(recorder.startRecording, "/home/nao", "film")
    recorder.setColorSpace(13)
    recorder.startRecording("/home/nao", "film")
    assert recorder.isRecording() and "already" in refused(recorder.startRecording, "/home/nao", "other")
    assert recorder.stopRecording()[1] == "/home/nao/film.avi"
    assert "exists already" in refused(recorder.startRecording, "/home/nao", "film.avi", False)
    recorder.setVideoFormat("MJPG")
    recorder.setFrameRate(2)
    assert "more than 2" in refused(recorder.startRecording, "/home/nao", "film")
    recorder.setFrameRate(15)
