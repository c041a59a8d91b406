"""Programs about cameras, marks and the tablet, run unchanged; what they did is seen in the world and on the disk."""

import cv2
import numpy as np
import pytest

from pepper_sim.disk import APPS

CAMERAS = "/home/nao/recordings/cameras"


def on_disk(naoqi, name):
    return naoqi.simulation.server.catalogue.disk.path(name)


def test_landmarks_are_where_they_stand(naoqi, run_against_robot, marks):
    lines = run_against_robot("pictures_landmarks", "--wanted", len(marks)).splitlines()
    found = {int(words[1]): tuple(map(float, words[3:])) for words in map(str.split, lines)}
    assert found.keys() == marks.keys()
    for number, place in marks.items():
        assert found[number] == pytest.approx(place, abs=0.06)
    assert naoqi.ALLandMarkDetection.getSubscribersInfo() == []


def test_a_qr_code_is_read(naoqi, run_against_robot, code):
    said, corners = run_against_robot("pictures_qr_codes").splitlines()
    assert said == f"code: {code}"
    first, second, third, fourth = (np.array(list(map(int, pair.split(",")))) for pair in corners.split()[1:])
    assert first[0] < fourth[0] and second[0] < third[0], "its top left corner is the first"
    assert first[1] < second[1] and fourth[1] < third[1], "the next one follows counter-clockwise"


def test_photographs_lie_on_the_robots_disk(naoqi, run_against_robot):
    lines = run_against_robot("pictures_photographs").splitlines()
    assert lines == [
        str([[f"{CAMERAS}/image_{number}.jpg" for number in range(3)]]),
        str([f"{CAMERAS}/portrait.png"]),
    ]
    for name in ("image_0.jpg", "image_1.jpg", "image_2.jpg", "portrait.png"):
        picture = cv2.imread(str(on_disk(naoqi, f"{CAMERAS}/{name}")))
        assert picture.shape == (480, 640, 3)
        blue, green, red = picture.reshape(-1, 3).astype(int).T
        assert ((red > 120) & (green < 60) & (blue < 60)).sum() > 1000, "the red disc is in it"


def test_a_film_lies_on_the_robots_disk(naoqi, run_against_robot):
    lines = run_against_robot("pictures_video", "--seconds", 1).splitlines()
    assert lines[:2] == ["Video record started.", f"Video was saved on the robot: {CAMERAS}/myvideo.avi"]
    film = cv2.VideoCapture(str(on_disk(naoqi, f"{CAMERAS}/myvideo.avi")))
    count = int(lines[2].removeprefix("Num frames: "))
    assert film.get(cv2.CAP_PROP_FPS) == 10.0 and 1 <= count == int(film.get(cv2.CAP_PROP_FRAME_COUNT))
    assert film.read()[1].shape == (240, 320, 3)
    assert naoqi.ALVideoRecorder.isRecording() is False


def test_a_large_picture_comes_with_depth_and_infrared(naoqi, run_against_robot, tmp_path):
    path = tmp_path / "picture.png"
    size, nearest, infrared = run_against_robot("pictures_colour_and_depth", path).splitlines()
    assert size == "picture 1280x960" and cv2.imread(str(path)).shape == (960, 1280, 3)
    depth = naoqi.robot.subscribe_camera("CameraDepth", 320, 240, 10.0, "depth")
    with depth:
        seen = depth.image.wait_newer(0, 5.0).content
    assert float(nearest.split()[1]) == pytest.approx(float(seen[seen > 0.4].min()), abs=0.02)
    count, brightest = (int(infrared.split()[place]) for place in (1, 5))
    assert count == 320 * 240 and 0 < brightest <= 1023


def test_the_tablet_greets(naoqi, start_against_robot, wait_until):
    folder = on_disk(naoqi, f"{APPS}/greeting/html")
    folder.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(folder / "hello.png"), np.full((40, 64, 3), (0, 140, 255), np.uint8))
    tablet = naoqi.simulation.tablet
    program = start_against_robot("pictures_tablet")
    wait_until(lambda: _at(tablet, 200, 320) == [255, 140, 0], "the picture is on the tablet")
    wait_until(lambda: _at(tablet, 5, 5) == [60, 60, 60], "the question is on the tablet")
    tablet.answer(True, "Ada")
    printed, _ = program.communicate(timeout=30)
    assert program.returncode == 0 and printed == "Hello, Ada\n"
    wait_until(lambda: _at(tablet, 200, 320) == [0, 0, 0], "the tablet is dark again")


def _at(tablet, row, column):
    """The colour of a place on the screen; none before its first picture."""
    picture = tablet.image.peek()
    return None if picture is None else picture.content[row, column].tolist()
