"""Robotino's wire, asked by a client made from the vendor's wiki: standard library only, nothing of ours."""

import json
import math
import socket
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest

from robotino_sim.simulation import Simulation

READABLE = [
    "odometry",
    "pose",
    "distancesensorarray",
    "bumper",
    "analoginputarray",
    "digitalinputarray",
    "digitaloutputstatus",
    "relaystatus",
    "powermanagement",
    "charger0",
    "charger1",
    "controllerinfo",
    "imageversion",
    "poweroutputcurrent",
    "services",
    "servicestatus/restapid",
    "program",
    "globalvars",
    "robviewout",
    "config",
    "wlanconfig",
    "wlanhwfound",
]


def number(value):
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


# --- reading ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", READABLE)
def test_every_reading_is_json_with_and_without_a_query(client, path):
    plain = client.get(f"/data/{path}")
    asked = client.get(f"/data/{path}?sid=example_circle&unknown=1")
    assert type(plain) is type(asked)


def test_shapes_and_types_of_the_readings(client):
    odometry = client.get("/data/odometry")
    assert len(odometry) == 7 and all(map(number, odometry)) and isinstance(odometry[6], int)
    distances = client.get("/data/distancesensorarray")
    assert len(distances) == 9 and all(0.04 <= d <= 0.41 for d in distances)
    assert client.get("/data/bumper") == {"value": False}
    assert client.get("/data/digitalinputarray") == client.get("/data/digitaloutputstatus") == [False] * 8
    assert client.get("/data/analoginputarray") == [0] * 8
    assert client.get("/data/relaystatus") == [False, False]
    assert client.get("/data/poweroutputcurrent") == {"current": 0}
    assert client.get("/data/imageversion")["version"].endswith("\n")
    assert set(client.get("/data/controllerinfo")["payload"]) == {"hardware", "software"}
    power = client.get("/data/powermanagement")
    assert power["batteryType"] in ("Pb", "NiMH", "Li-Ion")
    assert 15.0 < power["voltage"] < 30.0 and power["batteryLowShutdownCounter"] == 60000
    assert (power["batteryLow"], power["ext_power"], power["num_chargers"]) == (False, False, 2)
    assert {"bat1temp", "bat2temp", "batteryVoltage", "chargerNumber", "state"} < set(client.get("/data/charger1"))
    assert isinstance(client.get("/data/servicestatus/controld3")[0], str)


def test_services_can_be_read_as_names_and_as_a_tree(client):
    groups = {group["name"]: group for group in client.get("/data/services")}
    assert "controld3" in groups["robotino-daemons"]["services"]
    for group in groups.values():
        assert [node["name"] for node in group["_children"]] == group["services"]
        assert all(client.get(f"/data/servicestatus/{name}") for name in group["services"])


def test_whole_numbers_have_no_decimal_point(client):
    body = client.request("GET", "/data/odometry")[2]
    assert body.startswith(b"[0,0,0,0,0,0,") and b"." not in body


def test_sequence_rises_by_one_per_reading(client, wait_until):
    """A client that a busy machine holds up misses some; it asks until it has missed none for a while."""
    seen = [client.get("/data/odometry")[6]]

    def next_without_gap() -> bool:
        newest = client.get("/data/odometry")[6]
        if newest > seen[-1] + 1:
            seen.clear()
        if not seen or newest > seen[-1]:
            seen.append(newest)
        return len(seen) > 5

    wait_until(next_without_gap, "five new readings, each by one more than the one before")


@pytest.mark.parametrize("path", ["/data/festoolcharger", "/data/scan0"])
def test_absent_hardware_answers_with_an_empty_body(client, path):
    status, headers, body = client.request("GET", path)
    assert (status, headers["content-type"], body) == (200, "application/json", b"")


@pytest.mark.parametrize(
    "path", ["/data/poses", "/data/inputOutput", "/data/gantt", "/data/", "/swagger.json", "/cam1"]
)
def test_unknown_paths_are_404(client, path):
    assert client.request("GET", path)[0] == 404
    assert client.request("PUT", path, b"[0,0,0]")[0] == 404
    assert client.request("GET", "/data/servicestatus/nobody")[0] == 404


def test_options_and_head(client):
    for path in ("/data/odometry", "/data/omnidrive", "/cam0"):
        status, headers, body = client.request("OPTIONS", path)
        assert (status, headers["allow"], body) == (200, "DELETE, GET, POST, PUT", b"")
    status, headers, body = client.request("HEAD", "/data/bumper")
    assert (status, headers["content-type"], headers["content-length"], body) == (200, "application/json", "15", b"")
    assert "access-control-allow-origin" not in headers


def test_wrong_verbs_are_405(client):
    assert client.request("DELETE", "/data/bumper")[0] == 405
    assert client.request("PUT", "/data/bumper", b"true")[0] == 405
    assert client.request("GET", "/data/omnidrive")[0] == 405


def test_start_page_leads_to_every_reading(client):
    status, headers, body = client.request("GET", "/")
    assert (status, headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert b'href="/data/odometry"' in body and b'src="/cam0"' in body
    assert client.request("PUT", "/", b"1")[0] == 405


# --- pictures --------------------------------------------------------------------------------------------------------


def test_camera_gives_a_jpeg_of_the_room(client):
    status, headers, body = client.request("GET", "/cam0?stamp=17")
    assert (status, headers["content-type"]) == (200, "image/jpeg")
    picture = cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (240, 320, 3)
    assert picture.std() > 20.0


def test_camera_shows_the_robot_turning(client, simulation, wait_until):
    def picture():
        return cv2.imdecode(np.frombuffer(client.request("GET", "/cam0")[2], np.uint8), cv2.IMREAD_COLOR).astype(int)

    before = picture()
    wait_until(
        lambda: client.put("/data/omnidrive", [0, 0, 1]) and np.abs(picture() - before).mean() > 20, "a new view"
    )


def test_camera_is_released_and_wakes_again(client, simulation, wait_until):
    webcam = simulation.webcam
    client.request("GET", "/cam0")
    webcam._idle_release, kept = 0.2, webcam._idle_release
    wait_until(lambda: webcam.image.age() > 1.5, "no more pictures are drawn")
    webcam._idle_release = kept
    assert client.request("GET", "/cam0")[0] == 200


def test_strict_camera_answers_500_as_the_old_server_did(make_client, wait_until):
    with Simulation(port=0, strict_camera=True, camera_size=(160, 120)) as simulation:
        client = make_client(simulation.url)
        status, _, body = client.request("GET", "/cam0")
        assert (status, body.strip()) == (500, b"No camera connected")
        wait_until(lambda: client.request("GET", "/cam0")[0] == 200, "the camera is awake")
        with ThreadPoolExecutor(4) as clients:  # one alone is slower than the camera where the machine is busy
            seen: set[int] = set()

            def ask():
                seen.update(status for status, _, _ in clients.map(lambda _: client.request("GET", "/cam0"), range(4)))
                return len(seen) > 1

            wait_until(ask, "a picture that one of them gets, and the others none")
        assert seen == {200, 500}


def test_sensor_image_is_a_png(client):
    status, headers, body = client.request("GET", "/sensorimage")
    assert (status, headers["content-type"], body[:4]) == (200, "image/png", b"\x89PNG")


# --- driving ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["PUT", "POST"])
@pytest.mark.parametrize("content_type", [None, "application/json", "text/plain", "application/octet-stream"])
def test_drives_by_put_and_post_with_any_content_type(client, wait_until, method, content_type):
    def resend():
        assert client.request(method, "/data/omnidrive?sid=x", b"[0.2, 0, 0]", content_type)[::2] == (200, b"")
        return client.get("/data/odometry")[0] > 0.03

    wait_until(resend, "the robot drives forward")


def test_odometry_tells_the_commanded_velocity(client, wait_until):
    def resend():
        client.put("/data/omnidrive", [0, -0.15, 0.3])
        return client.get("/data/odometry")[3:6] == pytest.approx([0, -0.15, 0.3], abs=1e-6)

    wait_until(resend, "the commanded velocity is reached")


@pytest.mark.parametrize("watchdog", [0.2, 0.5])
def test_robot_stops_by_itself(make_client, wait_until, watchdog):
    with Simulation(port=0, watchdog=watchdog) as simulation:
        client = make_client(simulation.url)

        def resend():
            client.put("/data/omnidrive", [0.3, 0, 0])
            return client.get("/data/odometry")[3] > 0.25

        wait_until(resend, "the robot drives")
        wait_until(lambda: client.get("/data/odometry")[3:6] == [0, 0, 0], "the robot stands")
        rested = client.get("/data/odometry")[:3]
        time.sleep(0.3)  # in which it may not creep
        assert client.get("/data/odometry")[:3] == rested


def test_a_client_at_five_hertz_and_a_bit_keeps_it_moving(client, simulation):
    """Resending every 150 ms leaves the watchdog 50 ms; speed must not drop, but while the client is held up."""

    def usual_speed():
        speeds = []
        for i in range(12):
            client.put("/data/omnidrive", [0.1, 0, 0])
            time.sleep(0.15)
            if i > 5:
                speeds.append(client.get("/data/odometry")[3])
        return np.median(speeds)

    assert any(usual_speed() == pytest.approx(0.1, abs=1e-6) for _ in range(4))


BAD_DRIVES = [
    b"",
    b"[0.1,0]",
    b"[0.1,0,0,0]",
    b"[0.1,0,null]",
    b'["0.1",0,0]',
    b"[true,0,0]",
    b"[NaN,0,0]",
    b"[0,Infinity,0]",
    b"[1e999,0,0]",
    b'{"vx":0.1}',
    b"0.1",
    b"vx=0.1",
    b"[0.1,0,0",
    b"\xff\xff",
    b"[" * 10_000,
]


@pytest.mark.parametrize("body", BAD_DRIVES, ids=lambda body: repr(body[:12]))
def test_malformed_commands_are_refused_and_change_nothing(client, simulation, body):
    status, headers, reason = client.request("PUT", "/data/omnidrive", body)
    assert status == 400 and headers["content-type"].startswith("text/plain")
    assert len(reason) > 10
    assert client.get("/data/odometry")[3:6] == [0, 0, 0]
    assert simulation.robot.snapshot().motors == (0.0, 0.0, 0.0)


def test_too_large_a_body_is_refused(client):
    for size in (70_000, 5_000_000):
        assert client.request("PUT", "/data/omnidrive", b"[0.1,0,0]" + b" " * size)[0] == 413, "sent in full, answered"
    assert client.request("PUT", "/data/omnidrive", b"[0.1,0,0]" + b" " * 1000)[0] == 200


def test_chunked_bodies_are_read_and_limited(client):
    connection = client.connection()
    connection.request("PUT", "/data/relay", iter([b'{"num":', b'1,"val":true}']), encode_chunked=True)
    assert connection.getresponse().status == 200
    connection.close()
    assert client.get("/data/relaystatus") == [False, True]
    connection = client.connection()
    connection.request("PUT", "/data/relay", (b" " * 1000 for _ in range(80)), encode_chunked=True)
    assert connection.getresponse().status == 413
    connection.close()


def test_a_half_sent_request_disturbs_nobody(client):
    address = client.url.removeprefix("http://").split(":")
    with socket.create_connection((address[0], int(address[1])), timeout=5.0) as half:
        half.sendall(b"PUT /data/omnidrive HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n[0.1")
        assert client.get("/data/bumper") == {"value": False}
    assert client.get("/data/odometry")[3:6] == [0, 0, 0]


# --- inputs and outputs ----------------------------------------------------------------------------------------------


def test_outputs_are_set_one_by_one_and_all_at_once(client):
    assert client.put("/data/digitaloutput", {"num": 3, "val": True}) == 200
    assert client.get("/data/digitaloutputstatus") == [False, False, False, True] + [False] * 4
    assert client.put("/data/digitaloutputarray", [True] * 8) == 200
    assert client.get("/data/digitaloutputstatus") == [True] * 8
    assert client.put("/data/relay", {"num": 0, "val": True}) == 200
    assert client.get("/data/relaystatus") == [True, False]
    assert client.put("/data/relayarray", [False, True]) == 200
    assert client.get("/data/relaystatus") == [False, True]
    assert client.put("/data/poweroutput", {"value": -50}) == 200


def test_ones_and_zeros_are_booleans(client):
    assert client.put("/data/digitaloutput", {"num": 3, "val": 1}) == 200
    assert client.get("/data/digitaloutputstatus") == [False, False, False, True] + [False] * 4
    assert client.put("/data/digitaloutputarray", [1, 0, True, False, 1, 0, 0, 1]) == 200
    assert client.get("/data/digitaloutputstatus") == [True, False, True, False, True, False, False, True]
    assert client.put("/data/relay", {"num": 0, "val": 1}) == 200
    assert client.put("/data/relayarray", [0, 1]) == 200
    assert client.get("/data/relaystatus") == [False, True]


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("digitaloutput", {"num": 8, "val": True}),
        ("digitaloutput", {"num": 0}),
        ("digitaloutput", {"num": 0, "val": 2}),
        ("digitaloutput", [0, True]),
        ("digitaloutputarray", [True] * 7),
        ("digitaloutputarray", [True] * 7 + ["1"]),
        ("relay", {"num": -1, "val": True}),
        ("relay", {"num": 0.5, "val": True}),
        ("relayarray", [True]),
        ("poweroutput", {"value": "full"}),
        ("poweroutput", 50),
        ("uploadProgram", {"name": "x"}),
        ("remove", {"name": "x", "suffix": "rvwx"}),
    ],
)
def test_malformed_settings_are_refused(client, path, value):
    assert client.put(f"/data/{path}", value) == 400
    assert not any(client.get("/data/digitaloutputstatus") + client.get("/data/relaystatus"))


def test_inputs_show_what_is_applied_from_outside(client, simulation):
    simulation.robot.inputs_outputs.set_digital_input(2, True)
    simulation.robot.inputs_outputs.set_analog_input(5, 3.3)
    assert client.get("/data/digitalinputarray")[2] is True
    assert client.get("/data/analoginputarray")[5] == 3.3
    simulation.robot.press_bumper(True)
    assert client.get("/data/bumper") == {"value": True}


def test_programs_are_uploaded_and_downloaded(client):
    assert client.put("/data/uploadProgram", {"name": "a.rvwx", "size": 3, "data": "QUJD"}) == 200
    assert client.get("/data/program")[0]["name"] == "a"
    assert client.request("GET", "/download/program/a.rvwx")[::2] == (200, b"ABC")
    assert client.put("/data/startStopProgram", {"name": "a", "suffix": "rvwx"}) == 200
    assert client.get("/data/program")[0]["action"] == "running"
    assert client.put("/data/remove", {"name": "a", "suffix": "rvwx"}) == 200
    assert client.get("/data/program") == []


# --- variants --------------------------------------------------------------------------------------------------------


def test_a_robot_with_festool_packs_and_laser(make_client, wait_until):
    with Simulation(port=0, battery="Li-Ion", charging=True, laser=True, cors=True) as simulation:
        client = make_client(simulation.url)
        assert client.get("/data/powermanagement")["batteryType"] == "Li-Ion"
        payload = client.get("/data/festoolcharger")["payload"]
        assert len(payload["voltages"]) == len(payload["capacities"]) == 2
        assert payload["chargerConnected"] and payload["accuLoading"] == [1, 1]
        simulation.restart()
        assert client.get("/data/powermanagement")["ext_power"] is True
        assert client.request("GET", "/data/charger0")[::2] == (200, b"")
        wait_until(lambda: client.request("GET", "/data/scan0")[2], "a scan")
        scan = client.get("/data/scan0")
        assert len(scan["ranges"]) == len(scan["intensities"]) == 441
        assert scan["angle_min"] == -1.9198628664 and scan["range_max"] == 20
        assert all(0.0 <= r <= 20.0 for r in scan["ranges"]) and max(scan["ranges"]) > 1.0
        assert client.request("GET", "/data/bumper")[1]["access-control-allow-origin"] == "*"


# --- many clients ----------------------------------------------------------------------------------------------------


def test_curl_reads_and_drives(client):
    def curl(*arguments):
        return subprocess.run(["curl", "-sS", "--max-time", "10", *arguments], capture_output=True, check=True).stdout

    assert json.loads(curl(f"{client.url}/data/bumper")) == {"value": False}
    assert curl("-X", "PUT", "-d", "[0.1,0,0]", f"{client.url}/data/omnidrive") == b""
    assert curl("-X", "POST", "-d", "[0.1,0,0]", f"{client.url}/data/omnidrive", "-w", "%{http_code}") == b"200"
    two = curl(f"{client.url}/data/bumper", f"{client.url}/data/relaystatus", "-w", "%{num_connects}\n")
    assert two == b'{"value":false}1\n[false,false]0\n'  # one connection for both


@pytest.mark.parametrize("keep_alive", [True, False])
def test_three_hundred_requests_a_second_are_all_answered(client, keep_alive):
    paths = ("/data/odometry", "/data/distancesensorarray", "/data/bumper", "/data/powermanagement")
    clients, each, period = 4, 112, 4 / 300
    answers = []

    def ask(which):
        connection = client.connection()
        begin = time.monotonic() + which * period / clients
        for i in range(each):
            time.sleep(max(0.0, begin + i * period - time.monotonic()))
            if i % 4 == 3:
                connection.request("PUT", "/data/omnidrive", b"[0.05,0,0]")
            else:
                connection.request("GET", paths[(which + i) % 4])
            answer = connection.getresponse()
            answer.read()
            answers.append(answer.status)
            if not keep_alive:
                connection.close()
        connection.close()

    threads = [threading.Thread(target=ask, args=(which,)) for which in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60.0)
    assert answers == [200] * clients * each
