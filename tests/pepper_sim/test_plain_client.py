"""A program written from the maker's documentation alone, as it would run on the robot: plain qi, no word of ours."""

import http.server
import math
import threading
import time

import pytest
from naoqi_clients import with_both_clients

TOP, DEPTH = 0, 2
VGA, QVGA = 2, 1
YUV422, RGB, DISTANCE = 9, 11, 17


@pytest.fixture
def robot(qi, naoqi):
    """A fresh connection, as the program itself would make it."""
    session = qi.Session()
    session.connect(naoqi.simulation.url)
    yield session
    session.close()


def test_wake_up_and_postures(robot):
    motion, posture = robot.service("ALMotion"), robot.service("ALRobotPosture")
    motion.wakeUp()
    assert posture.goToPosture("StandInit", 0.5)
    assert posture.getPostureFamily() == "Standing"
    assert posture.goToPosture("Crouch", 0.8)
    assert posture.getPosture() == "Crouch"


def test_moving_joints(robot, wait_until):
    motion = robot.service("ALMotion")
    motion.setStiffnesses("Head", 1.0)
    motion.setAngles("HeadYaw", 30.0 * math.pi / 180.0, 0.2)
    wait_until(lambda: motion.getAngles("HeadYaw", True) == pytest.approx([0.5236], abs=0.03), "the head is there")
    motion.angleInterpolation(["HeadYaw", "HeadPitch"], [[0.5, 0.0], [-0.2, 0.0]], [[0.5, 1.0], [0.5, 1.0]], True)
    assert motion.getAngles("Head", True) == pytest.approx([0.0, 0.0], abs=0.03)
    motion.angleInterpolation("HeadYaw", [0.3, -0.3, 0.0], [0.4, 0.8, 1.2], True)
    assert motion.getAngles("HeadYaw", False) == pytest.approx([0.0], abs=0.03)


def test_half_a_metre_and_a_turn(robot, naoqi):
    motion = robot.service("ALMotion")
    motion.moveInit()
    start, truth = motion.getRobotPosition(True), naoqi.robot.truth()
    assert motion.moveTo(0.5, 0.0, math.pi / 4) is True
    end, arrived = motion.getRobotPosition(True), naoqi.robot.truth()
    for before, after in ((start, end), ((truth[0], truth[1], truth[5]), (arrived[0], arrived[1], arrived[5]))):
        dx, dy = after[0] - before[0], after[1] - before[1]
        c, s = math.cos(before[2]), math.sin(before[2])
        assert math.hypot(dx * c + dy * s - 0.5, dy * c - dx * s) < 0.03
        assert abs(math.remainder(after[2] - before[2] - math.pi / 4, math.tau)) < math.radians(3)


def test_driving_and_stopping(robot):
    motion = robot.service("ALMotion")
    motion.moveToward(0.5, 0.0, 0.0, [["Frequency", 1.0]])
    time.sleep(1.5)  # the ramp takes 0.175 / 0.3 s
    assert motion.moveIsActive()
    assert motion.getRobotVelocity()[0] == pytest.approx(0.175, abs=0.01), "half of 0.35 m/s"
    motion.stopMove()
    assert motion.getRobotVelocity() == pytest.approx([0, 0, 0], abs=1e-3)


@with_both_clients
@pytest.mark.parametrize(
    ("camera", "resolution", "space", "layers"), [(TOP, VGA, RGB, 3), (TOP, VGA, YUV422, 2), (DEPTH, QVGA, DISTANCE, 2)]
)
def test_pictures(robot, camera, resolution, space, layers):
    video = robot.service("ALVideoDevice")
    client = video.subscribeCamera("python_client", camera, resolution, space, 15)
    try:
        for _ in range(3):
            image = video.getImageRemote(client)
            assert image is not None
            width, height, pixels = image[0], image[1], image[6]
            assert image[2] == layers and image[3] == space and image[7] == camera
            assert isinstance(pixels, bytes | bytearray) and len(pixels) == width * height * layers
            assert abs(time.time() - (image[4] + image[5] * 1e-6)) < 2.0
            video.releaseImage(client)
    finally:
        assert video.unsubscribe(client)


@with_both_clients
def test_reading_sensors(robot):
    memory = robot.service("ALMemory")
    robot.service("ALSonar").subscribe("python_client")
    sonar = memory.getData("Device/SubDeviceList/Platform/Front/Sonar/Sensor/Value")
    assert 0.2 < sonar <= 5.0
    laser = [
        f"Device/SubDeviceList/Platform/LaserSensor/Front/Horizontal/Seg{n:02d}/{axis}/Sensor/Value"
        for n in range(1, 16)
        for axis in "XY"
    ]
    values = memory.getListData(laser)
    assert all(isinstance(value, float) and math.isfinite(value) for value in values)
    assert values[1] > 0 > values[-1], "segment 1 is the leftmost"
    battery, touch, gyro = memory.getListData(
        [
            "Device/SubDeviceList/Battery/Charge/Sensor/Value",
            "Device/SubDeviceList/Head/Touch/Front/Sensor/Value",
            "Device/SubDeviceList/InertialSensorBase/GyroscopeZ/Sensor/Value",
        ]
    )
    assert 0 < battery <= 1 and touch == 0.0 and abs(gyro) < 0.1
    robot.service("ALSonar").unsubscribe("python_client")


@with_both_clients
def test_hearing_a_touch(robot, naoqi):
    touched = threading.Event()
    memory = robot.service("ALMemory")
    subscriber = memory.subscriber("FrontTactilTouched")
    subscriber.signal.connect(lambda value: touched.set() if value == 1.0 else None)
    naoqi.robot.press("FrontTactil", True)
    assert touched.wait(10)
    naoqi.robot.press("FrontTactil", False)


def test_showing_a_page_on_the_tablet(robot, naoqi, wait_until):
    asked = []

    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<html><body>hello</body></html>")

        def log_message(self, *_):
            """Quiet."""

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        tablet = robot.service("ALTabletService")
        assert tablet.loadUrl(f"http://127.0.0.1:{server.server_address[1]}/index.html") is True
        assert tablet.showWebview() is True
        wait_until(lambda: "/index.html" in asked, "the tablet asked for the page")
        assert tablet.hideWebview() is True
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@with_both_clients
def test_saying_something(robot):
    begin = time.time()
    robot.service("ALTextToSpeech").say("Hello, human.")
    assert time.time() - begin > 0.4
