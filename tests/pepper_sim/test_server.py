"""The server as a whole: what is there, and that nothing a client does can break it or move the robot by accident."""

import math
import os
import random
import socket
import struct
import subprocess
import sys
import threading
import time

import pytest
from naoqi_clients import connected
from naoqi_relay import Between

from pepper_sim.server import CannotListen, NaoqiServer

HEADER = struct.Struct("<IIIHBBIII")
MAGIC = 0x42ADDE42
MINIMUM = """
ALVideoDevice ALMemory ALTabletService ALAutonomousLife ALServiceManager ALSystem ALMotion
ALAudioDevice ALRobotModel ALSonar ALBodyTemperature ALTextToSpeech LogManager
ALRobotPosture ALTracker ALAnimatedSpeech ALNavigation ALBattery ALBasicAwareness ALLeds ALFaceDetection ALAudioPlayer
ALAnimationPlayer ALBehaviorManager ALFaceCharacteristics ALPeoplePerception ALSpeechRecognition ALDialog
ALAudioRecorder ALAutonomousBlinking
""".split()
"""Services that the original program, naoqi_driver (C++) and Pepper-Controller open at their start."""

JUNK = [
    *(None, math.nan, math.inf, -1, 2**40, True, 0.5, "", "Body", "\u2603" * 50, "x" * 5000, b"\xff\x00"),
    *([], [[]], {}, {"a": [1]}, [math.nan], ["x", 1], [[1, 2], [3]], [None], [[["deep"]]], list(range(1000))),
]
POISON = [math.nan, None, "fast", [], {"x": 1}, [math.nan]]


def _still(naoqi):
    x, y, _, _, _, theta = naoqi.robot.truth()
    return x, y, theta, *naoqi.robot.snapshot().joint_setpoints.values()


def _alive(naoqi, connect):
    client = connect()
    assert client.service("ALMotion").ping() is True
    assert client.service("ALMemory").getListData(["DCM/Time"])[0] > 0
    assert naoqi.ALMotion.getBodyNames("Head") == ["HeadYaw", "HeadPitch"]


def test_the_minimum_set_of_services_is_there(session):
    names = {info["name"] for info in session.services()}
    assert set(MINIMUM) <= names
    assert not {name for name in names if name.startswith("_")}, "nothing internal is listed"
    for name in MINIMUM:
        assert session.service(name).metaObject()["methods"]


def test_services_are_listed_as_robots_of_this_version_list_them(naoqi, session):
    """The layout of a robot with NAOqi 2.5 and of a NAO V6 with 2.8; libqi 4 adds an objectUid."""
    fields = ["name", "serviceId", "machineId", "processId", "endpoints", "sessionId"]
    assert naoqi.ALSystem.systemVersion().startswith("2.5")
    methods = session.service("ServiceDirectory").metaObject()["methods"]
    assert methods[100]["returnSignature"] == f"(sIsI[s]s)<ServiceInfo,{','.join(fields)}>"
    assert methods[101]["returnSignature"] == f"[{methods[100]['returnSignature']}]"


def test_a_client_behind_a_port_forward_stays_on_its_connection(qi, simulation):
    """Of a container, for example: the addresses that the robot lists lead nowhere there."""
    connections = simulation.server._server._connections
    before, port = set(connections), int(simulation.url.rpartition(":")[2])
    with Between(port) as relay, connected(qi, relay.url) as client:
        assert client.service("ALMotion").ping() and client.service("ALMemory").ping()
        assert len(connections - before) == 1


def test_only_the_declared_methods_can_be_called(session):
    inherited = {"isRunning", "getMethodList", "ping", "version", "wait", "stop", "exit", "getBrokerName"}
    for name in ("ALMotion", "ALMemory", "ALVideoDevice", "ALTextToSpeech"):
        methods = session.service(name).metaObject()["methods"].values()
        assert inherited <= {method["name"] for method in methods}
        assert not {"close", "parts", "bindings", "announce", "store"} & {method["name"] for method in methods}


def test_signatures_are_those_of_the_real_robot(session):
    """The signatures come from a metaobject of a Pepper with NAOqi 2.5."""
    methods = session.service("ALMotion").metaObject()["methods"].values()
    found = {(m["name"], m["parametersSignature"], m["returnSignature"]) for m in methods}
    assert {
        *(("move", "(fff)", "v"), ("move", "(fffm)", "v"), ("moveToward", "(fffm)", "v")),
        *(("moveTo", "(fff)", "b"), ("moveTo", "(ffff)", "b"), ("moveTo", "(fffm)", "b"), ("moveTo", "(ffffm)", "b")),
        *(("moveTo", "(m)", "b"), ("moveTo", "(mm)", "b"), ("stopMove", "()", "b"), ("moveInit", "()", "v")),
        *(("setAngles", "(mmf)", "v"), ("setAngles", "(mm[f])", "v"), ("getAngles", "(mb)", "[f]")),
        *(("angleInterpolation", "(mmmb)", "v"), ("angleInterpolationBezier", "([s]mm)", "v")),
        *(("getRobotPosition", "(b)", "[f]"), ("getRobotVelocity", "()", "[f]"), ("getMoveConfig", "(s)", "m")),
        *(("setStiffnesses", "(mm)", "v"), ("getStiffnesses", "(m)", "[f]"), ("robotIsWakeUp", "()", "b")),
    } <= found


def test_random_malformed_calls_leave_the_robot_still_and_the_server_alive(naoqi, connect):
    dice = random.Random(20)
    client = connect()
    calls = []
    for info in client.services():
        service = client.service(info["name"])
        for uid, method in service.metaObject()["methods"].items():
            kinds = method["parametersSignature"]
            if uid >= 100 and kinds.startswith("(") and kinds != "()" and method["name"] != "registerService":
                calls.append((service, method["name"], kinds[1:-1]))
    calls = [call for call in calls if call[1] not in ("unregisterService", "updateServiceInfo", "serviceReady")]
    before = _still(naoqi)
    refusals = 0
    for _ in range(400):
        service, name, kinds = dice.choice(calls)
        count = len(kinds.replace("[", "").replace("]", ""))
        arguments = [dice.choice(JUNK) for _ in range(count)]
        if "f" in kinds:
            arguments[kinds.replace("[", "").replace("]", "").index("f")] = dice.choice(POISON)
        if dice.random() < 0.1:
            arguments = arguments[:-1]
        call = service.call(name, *arguments, _async=True)
        call.wait(15_000)
        assert call.isFinished(), f"{name}{arguments!r:.200} did not end"
        if call.hasError(0):
            refusals += 1
            text = call.error(0)
            assert "Traceback" not in text and ".py" not in text and "internal error" not in text, text
    naoqi.ALTextToSpeech.stopAll()
    for service in [service for service, name, kinds in calls if (name, kinds) == ("pause", "b")]:
        service.pause(False)  # infinity counts as true, and the tests that follow talk to this robot
    assert refusals > 200
    assert _still(naoqi) == pytest.approx(before, abs=2e-3)
    _alive(naoqi, connect)


def _header(size, kind=1, service=1, obj=1, action=101, magic=MAGIC):
    return HEADER.pack(magic, 1, size, 0, kind, 0, service, obj, action)


@pytest.mark.parametrize(
    "data",
    [
        b"GET / HTTP/1.1\r\nHost: pepper\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(range(64)),
        _header(0)[:13],
        _header(100) + b"x" * 10,
        _header(0xFFFFFFFF) + b"x" * 100,
        _header(1 << 30, service=0, obj=0, action=8) + b"x" * 1000,
        _header(4, service=0, obj=0, action=8) + b"\xff\xff\xff\xff",
        _header(8, service=0, obj=0, action=8) + struct.pack("<I", 2**31) + b"\0\0\0\0",
        _header(0, kind=200),
        _header(0, service=77, obj=3, action=9),
        random.Random(7).randbytes(10_000),
        b"",
    ],
    ids=lambda data: f"{data[:8].hex()}-{len(data)}",
)
def test_sockets_that_send_nonsense_disturb_nobody(naoqi, connect, simulation, data):
    before = _still(naoqi)
    address = ("127.0.0.1", int(simulation.url.rsplit(":", 1)[1]))
    held = [socket.create_connection(address, timeout=5) for _ in range(3)]
    for connection in held:
        connection.sendall(data)
    _alive(naoqi, connect)
    for connection in held:
        connection.close()
    _alive(naoqi, connect)
    assert _still(naoqi) == pytest.approx(before, abs=2e-3)


def test_many_half_open_connections(naoqi, connect, simulation):
    address = ("127.0.0.1", int(simulation.url.rsplit(":", 1)[1]))
    held = []
    for number in range(200):
        connection = socket.create_connection(address, timeout=5)
        connection.sendall(_header(50)[: number % 29])
        held.append(connection)
    _alive(naoqi, connect)
    for connection in held:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # reset, not a polite end
        connection.close()
    _alive(naoqi, connect)


def test_huge_messages_end_their_connection_and_take_no_memory(naoqi, connect):
    before = _resident()
    client = connect()
    with pytest.raises(RuntimeError):
        client.service("ALMemory").insertData("Test/Huge", "x" * (40 * 1024 * 1024))
    _alive(naoqi, connect)
    assert _resident() - before < 200
    assert naoqi.ALMemory.getListData(["Test/Huge"]) == [None]


def _resident():
    """Megabytes of this process, the clients' included."""
    with open("/proc/self/statm") as text:
        return int(text.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 2**20


KILLED = """
import importlib, sys, time
qi = importlib.import_module(sys.argv[2])
session = qi.Session(); session.connect(sys.argv[1])
motion = session.service("ALMotion"); video = session.service("ALVideoDevice"); memory = session.service("ALMemory")
handle = video.subscribeCamera("killed", 0, 2, 11, 30)
subscriber = memory.subscriber("FrontTactilTouched"); subscriber.signal.connect(print)
calls = [motion.moveTo(2.0, 0.0, 0.0, _async=True), video.getImageRemote(handle, _async=True)]
print("busy", flush=True)
time.sleep(60)
"""


def test_a_client_killed_in_the_middle_of_everything(qi, naoqi, connect, simulation):
    command = [sys.executable, "-c", KILLED, simulation.url, qi.__name__]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout.readline().strip() == "busy"
        client.kill()
    for _ in range(3):
        naoqi.robot.press("FrontTactil", True)
        time.sleep(0.03)
        naoqi.robot.press("FrontTactil", False)
    _alive(naoqi, connect)
    naoqi.ALMotion.stopMove()
    naoqi.ALVideoDevice.unsubscribeAllInstances("killed")


def test_stop_does_not_wait_for_long_calls(naoqi, connect, wait_until):
    """All clients share the server's threads; long calls must not occupy them."""
    busy = connect()
    calls = [busy.service("ALMotion").angleInterpolation("HeadYaw", 0.5, 20.0, True, _async=True) for _ in range(3)]
    calls += [busy.service("ALTextToSpeech").say("a very long sentence " * 20, _async=True) for _ in range(5)]
    tries = []
    while not any(seconds < 2.0 and not arrived for seconds, arrived in tries):
        assert len(tries) < 4, f"(seconds until it was stopped, whether it arrived all the same) {tries}"
        move = busy.service("ALMotion").moveTo(1.0, 0.0, 0.0, _async=True)
        wait_until(lambda move=move: naoqi.ALMotion.moveIsActive() or move.isFinished(), "it drives")
        begin = time.monotonic()
        assert naoqi.ALMotion.stopMove() is True
        seconds = time.monotonic() - begin
        tries.append((seconds, move.value(10_000)))
    naoqi.ALTextToSpeech.stopAll()
    naoqi.ALMotion.killAll()
    for call in calls:
        call.wait(5000)
        assert call.isFinished()


def test_many_clients_at_once(naoqi, connect):
    clients = [connect() for _ in range(10)]
    failures = []

    def work(client):
        try:
            memory, motion = client.service("ALMemory"), client.service("ALMotion")
            for number in range(50):
                memory.raiseEvent("Test/Many", number)
                motion.getAngles("Body", True)
        except RuntimeError as error:
            failures.append(error)

    threads = [threading.Thread(target=work, args=(client,)) for client in clients]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=30)
    assert not failures and not any(thread.is_alive() for thread in threads)


def test_a_taken_port_is_reported_plainly(simulation):
    with pytest.raises(CannotListen, match=r"cannot listen on tcp://127\.0\.0\.1:\d+: Address already in use"):
        NaoqiServer(simulation.robot, simulation.url)


def test_every_service_is_there_when_the_port_opens(qi, simulation, session, free_port):
    port, made = free_port(), []
    making = threading.Thread(target=lambda: made.append(NaoqiServer(simulation.robot, f"tcp://127.0.0.1:{port}")))
    making.start()
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            break
        except ConnectionRefusedError:
            time.sleep(0.001)
    client = qi.Session()
    client.connect(f"tcp://127.0.0.1:{port}")
    names = {info["name"] for info in client.services()}
    making.join()
    client.close()
    made[0].close()
    assert names == {info["name"] for info in session.services()} - {"ALTabletService"}


def test_a_server_closes_and_its_clients_notice(qi, simulation, wait_until):
    server = NaoqiServer(simulation.robot, "tcp://127.0.0.1:0")
    client = qi.Session()
    client.connect(server.endpoints[0])
    names = {info["name"] for info in client.services()}
    assert "ALMotion" in names and "ALTabletService" not in names, "this one was made without a tablet"
    gone = []
    client.disconnected.connect(gone.append)
    before = threading.active_count()
    server.close()
    server.close()
    wait_until(lambda: gone, "the client noticed")
    wait_until(lambda: threading.active_count() < before, "the server's threads ended")
    client.close()
