"""A stranger attacks the robot's camera sender and sound server, and robots attack the pilot's clients.

Each test is one attack on running programs; its name says what is tried, and it passes when that fails.
"""

from __future__ import annotations

import contextlib
import http.client
import os
import random
import re
import resource
import secrets
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from attacked_services import HOST, SDP, SOURCES, FalseRobot, Service, make_offer
from rto_node.webrtc_camera import WebrtcCamera

from telepresence.security import signed_requests
from telepresence.security.robot_key import RobotKey

pytestmark = pytest.mark.slow

ELSEWHERE = "127.0.0.2"
"""Another address, to which nobody asked anybody to send anything."""
HALF_REQUESTS = 1024
NOBODY = 65534
"""Another user of this machine."""
SERVICES = ("camera", "sound")


@pytest.fixture(scope="module")
def offers() -> dict[str, bytes]:
    return {"camera": make_offer("video"), "sound": make_offer("audio")}


@pytest.fixture(scope="module")
def key_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("robot") / "robot.key"
    RobotKey.make(path)
    return path


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str, Path | None], Service]]:
    folder, started = tmp_path_factory.mktemp("log"), []

    def start(role: str, key: Path | None) -> Service:
        started.append(Service(role, folder, key))
        return started[-1]

    yield start
    for each in started:
        each.end()


@pytest.fixture(scope="module")
def services(start: Callable, key_file: Path) -> dict[str, Service]:
    return {role: start(role, key_file) for role in SERVICES}


@pytest.fixture(scope="module")
def open_camera(start: Callable) -> Service:
    """As it runs beside a simulated robot: on loopback, without a key."""
    return start("camera", None)


@pytest.fixture(params=SERVICES)
def service(request: pytest.FixtureRequest, services: dict[str, Service]) -> Service:
    return services[request.param]


@pytest.fixture
def leave(wait_until: Callable) -> Iterator[Callable[[Service, tuple[int, dict[str, str], bytes]], None]]:
    """Ends what an attack that got through began."""
    begun: list[tuple[Service, str]] = []

    def note(service: Service, answer: tuple[int, dict[str, str], bytes]) -> None:
        if answer[0] == 201:
            begun.append((service, answer[1]["Location"]))

    yield note
    for service, place in begun:
        service.ask_as_pilot("DELETE", place)


# --- without the key -------------------------------------------------------------------------------------------------


def test_a_stranger_reads_who_is_served(service: Service) -> None:
    status, _, body = service.ask()
    assert status in (401, 403) and b"{" not in body


def test_a_stranger_watches_or_listens(service: Service, offers: dict[str, bytes], leave: Callable) -> None:
    """Nothing is said about the robot, and less than was asked."""
    answer = service.ask("POST", body=offers[service.role])
    leave(service, answer)
    assert answer[0] in (401, 403) and b"v=0" not in answer[2]
    assert len(answer[2]) + sum(map(len, [*answer[1], *answer[1].values()])) < len(offers[service.role])


def test_a_stranger_with_another_key_watches_or_listens(
    service: Service, offers: dict[str, bytes], leave: Callable
) -> None:
    offer = offers[service.role]
    headers = service.sign("POST", body=offer, key=RobotKey(secrets.token_bytes(32)))
    answer = service.ask("POST", body=offer, headers=headers)
    leave(service, answer)
    assert answer[0] == 403


@pytest.mark.parametrize("what", ["again", "other body", "other path", "other robot", "other challenge"])
def test_a_stranger_uses_what_a_pilot_has_sent(
    what: str, services: dict[str, Service], offers: dict[str, bytes], leave: Callable
) -> None:
    camera, body, path = services["camera"], offers["camera"], "/camera"
    headers = camera.sign("POST", body=body)
    target = camera
    if what == "again":
        first = camera.ask("POST", body=body, headers=headers)
        leave(camera, first)
        assert first[0] == 201
    elif what == "other body":  # the stranger's own certificate in place of the pilot's
        body = re.sub(rb"(a=fingerprint:sha-256 )..", rb"\g<1>00", body)
    elif what == "other path":
        path = "/camera?time=1"
    elif what == "other robot":
        target, path = services["sound"], "/sound"
    elif headers:
        challenge = signed_requests.challenge_in(camera.ask()[1]["WWW-Authenticate"])
        headers = {"Authorization": re.sub('challenge="[^"]*"', f'challenge="{challenge}"', headers["Authorization"])}
    answer = target.ask("POST", path, offers["sound"] if what == "other robot" else body, headers)
    leave(target, answer)
    assert answer[0] in (401, 403)


@pytest.mark.parametrize("known", ["a name that was overheard", "the first numbers"])
def test_a_stranger_ends_what_a_pilot_has(
    known: str, service: Service, offers: dict[str, bytes], leave: Callable
) -> None:
    answer = service.ask_as_pilot("POST", body=offers[service.role])
    leave(service, answer)
    assert answer[0] == 201
    overheard = known.startswith("a name")
    places = [answer[1]["Location"]] if overheard else [f"{service.path}/{number}" for number in range(1, 40)]
    # Who guesses is an invited pilot at most; who has overheard a name is not.
    ask = service.ask if overheard else service.ask_as_pilot
    assert 200 not in [ask("DELETE", place)[0] for place in places]


def test_a_stranger_makes_the_robot_send_to_somebody_else(service: Service, leave: Callable) -> None:
    _sends_elsewhere(service, leave, service.ask)


def test_a_pilot_makes_the_robot_send_to_somebody_else(service: Service, leave: Callable) -> None:
    _sends_elsewhere(service, leave, service.ask_as_pilot)


def _sends_elsewhere(service: Service, leave: Callable, ask: Callable) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as victim:
        victim.bind((HOST if ask == service.ask else ELSEWHERE, 0))
        victim.settimeout(0.5)  # the first checks go out at once
        kind = "video" if service.role == "camera" else "audio"
        answer = ask("POST", "", make_offer(kind, victim.getsockname()))
        leave(service, answer)
        with pytest.raises(TimeoutError):
            victim.recv(2000)


# --- places ----------------------------------------------------------------------------------------------------------


def test_more_receivers_than_there_are_places_begin_together(
    services: dict[str, Service], offers: dict[str, bytes], leave: Callable
) -> None:
    """All of them have begun their offers before the first ends it."""
    camera, body = services["camera"], offers["camera"]
    with contextlib.ExitStack() as opened:
        begun = [opened.enter_context(_begin(camera, body)) for _ in range(6)]
        time.sleep(0.2)  # until all of them are being read, which nobody outside can see
        for each in begun:
            each.sendall(body[-1:])
        answers = [_answer(each) for each in begun]
    for answer in answers:
        leave(camera, answer)
    assert [answer[0] for answer in answers].count(201) == 3, [answer[0] for answer in answers]


def test_an_offer_that_was_begun_earlier_takes_over_a_conversation(
    services: dict[str, Service], offers: dict[str, bytes], leave: Callable
) -> None:
    sound, body = services["sound"], offers["sound"]
    with _begin(sound, body) as earlier:
        first = sound.ask_as_pilot("POST", body=body)
        leave(sound, first)
        assert first[0] == 201
        earlier.sendall(body[-1:])
        second = _answer(earlier)
        leave(sound, second)
    assert second[0] == 503
    assert sound.ask_as_pilot("DELETE", first[1]["Location"])[0] == 200, "the first one still talks"


def _begin(service: Service, body: bytes) -> socket.socket:
    """An invited pilot's offer, but for its last byte."""
    lines = [f"POST {service.path} HTTP/1.1", f"Host: {HOST}", f"Content-Type: {SDP}", f"Content-Length: {len(body)}"]
    lines += [f"{name}: {value}" for name, value in service.sign("POST", body=body).items()]
    connection = service.connect()
    connection.sendall("\r\n".join([*lines, "", ""]).encode() + body[:-1])
    return connection


def _answer(connection: socket.socket) -> tuple[int, dict[str, str], bytes]:
    answer = http.client.HTTPResponse(connection)
    try:
        answer.begin()
        return answer.status, dict(answer.headers), answer.read()
    except (ConnectionError, http.client.HTTPException):
        return 0, {}, b""


# --- floods ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def flooded(start: Callable, key_file: Path) -> Iterator[tuple[Service, int]]:
    """A camera sender with 1,024 half requests before it, and what its log had before."""
    camera, held = start("camera", key_file), []
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, 4 * HALF_REQUESTS)), hard))
    before = camera.log.stat().st_size
    try:
        for _ in range(HALF_REQUESTS):
            held.append(camera.connect())
            with contextlib.suppress(ConnectionError):  # it was ended already
                held[-1].sendall(b"POST /camera HTTP/1.1\r\nContent-Length: 2000\r\nX: ")
        yield camera, before
    finally:
        for each in held:
            each.close()
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_half_requests_keep_a_pilot_out(
    flooded: tuple[Service, int], offers: dict[str, bytes], leave: Callable
) -> None:
    camera, _ = flooded
    began = time.monotonic()
    answer = camera.ask_as_pilot("POST", body=offers["camera"])
    leave(camera, answer)
    assert answer[0] == 201 and time.monotonic() - began < 5.0


def test_half_requests_take_all_files(flooded: tuple[Service, int]) -> None:
    assert len(os.listdir(f"/proc/{flooded[0].process.pid}/fd")) < 128


def test_half_requests_fill_the_log(flooded: tuple[Service, int]) -> None:
    camera, before = flooded
    assert camera.log.stat().st_size - before < 4096


def test_nonsense_fills_the_log(services: dict[str, Service]) -> None:
    camera = services["camera"]
    before, began = camera.log.stat().st_size, time.monotonic()
    for _ in range(100):
        with contextlib.suppress(ConnectionError), camera.connect() as connection:
            connection.sendall(b"GET /\x01\xff\x1b]0;title HTTP/9.9\r\n: \r\n\r\n")
            connection.recv(100)
    written = camera.log.read_bytes()[before:]
    assert written.count(b"\n") < 20 + 2 * (time.monotonic() - began), written[-3000:]
    assert b"\x1b" not in written


@pytest.fixture(scope="module")
def slow_requests(services: dict[str, Service], offers: dict[str, bytes]) -> Iterator[dict[str, float]]:
    """How long requests lived that come a byte at a time [s]; "inf" for those that were not ended."""
    camera, body = services["camera"], offers["camera"]
    head = f"POST /camera HTTP/1.1\r\nHost: {HOST}\r\nContent-Type: {SDP}\r\n"
    head += "".join(f"{name}: {value}\r\n" for name, value in camera.sign("POST", body=body).items())
    begins = {
        "nothing": b"",
        "header": b"GET /camera HTTP/1.1\r\nX: ",
        "body": head.encode() + b"Content-Length: 500\r\n\r\n",
    }
    opened = {name: camera.connect() for name in begins}
    began, lived = time.monotonic(), dict.fromkeys(begins, float("inf"))
    for name, connection in opened.items():
        connection.sendall(begins[name])
        connection.setblocking(False)
    while time.monotonic() - began < 5.0 and float("inf") in lived.values():
        for name, connection in opened.items():
            if lived[name] < float("inf"):
                continue
            try:
                if name != "nothing":
                    connection.sendall(b"x")
                connection.recv(1000)
                ended = True  # by an answer, too
            except BlockingIOError:
                ended = False
            except ConnectionError:
                ended = True
            if ended:
                lived[name] = time.monotonic() - began
        time.sleep(0.2)
    for connection in opened.values():
        connection.close()
    yield lived


@pytest.mark.parametrize("part", ["nothing", "header", "body"])
def test_a_request_that_never_ends_holds_a_connection(part: str, slow_requests: dict[str, float]) -> None:
    assert slow_requests[part] < 5.0


def test_changed_offers_end_the_service(service: Service, offers: dict[str, bytes], leave: Callable) -> None:
    """They come from who has the key, or the pilot's machine was taken over."""
    seed = random.Random(service.role)
    for _ in range(25):
        offer = bytearray(offers[service.role])
        for _ in range(seed.randrange(1, 12)):
            at = seed.randrange(len(offer))
            offer[at : at + seed.randrange(4)] = seed.choice([b"", b"\n", b"0", b"-1", b"99999999999", b"\xff", b"m="])
        answer = service.ask_as_pilot("POST", body=bytes(offer))
        assert answer[0] in (201, 400, 503), answer
        if answer[0] == 201:
            service.ask_as_pilot("DELETE", answer[1]["Location"])
    answer = service.ask_as_pilot("POST", body=offers[service.role])
    leave(service, answer)
    assert answer[0] == 201


# --- without a key: a simulated robot --------------------------------------------------------------------------------


@pytest.mark.parametrize("header", ["Host: pictures.example", "Origin: http://pictures.example"])
def test_a_web_page_asks_a_simulated_robot(header: str, open_camera: Service) -> None:
    """The page's own name may have been led here (DNS rebinding)."""
    name, value = header.split(": ")
    status, _, body = open_camera.ask(headers={name: value})
    assert status == 403 and b"{" not in body


def test_another_user_of_this_machine_watches_a_simulated_robot(open_camera: Service) -> None:
    code = f"import http.client; c = http.client.HTTPConnection('{HOST}', {open_camera.port}, timeout=10); "
    code += "c.request('GET', '/camera'); print(c.getresponse().status)"
    asked = subprocess.run(["/usr/bin/python3", "-c", code], user=NOBODY, capture_output=True, text=True, check=True)
    assert asked.stdout.strip() == "403"


# --- robots that attack the pilot ------------------------------------------------------------------------------------


@pytest.fixture
def watch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wait_until: Callable
) -> Iterator[Callable[..., WebrtcCamera]]:
    """A pilot looks through what answers at a port; returns after its first attempt."""
    closing: list = []

    def watch(camera: Service, change: Callable = lambda *answer: answer, key: RobotKey | None = None) -> WebrtcCamera:
        if key is not None:
            monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
            key.store(HOST)
        robot = FalseRobot(camera, change)
        pilot = WebrtcCamera(f"{HOST}:{robot.port}")
        closing.extend([pilot, robot])
        pilot.want(True)
        wait_until(lambda: pilot.problem != "not connected yet" or pilot.received, "the first attempt")
        return pilot

    yield watch
    for each in closing:
        each.close()


def test_somebody_without_the_key_answers_in_the_robots_place(
    open_camera: Service, watch: Callable, services: dict[str, Service], wait_until: Callable
) -> None:
    pilot = watch(open_camera, key=services["camera"].key)
    wait_until(lambda: pilot.received or "no proof" in pilot.problem, "what is wrong is said")
    assert not pilot.received


def test_somebody_in_between_changes_the_answer(
    services: dict[str, Service], watch: Callable, wait_until: Callable
) -> None:
    """Where the pictures come from, and with which certificate."""

    def change(status: int, headers: dict[str, str], body: bytes) -> tuple:
        return status, headers, body.replace(b"c=IN IP4 127.0.0.1", b"c=IN IP4 127.0.0.9")

    camera = services["camera"]
    pilot = watch(camera, change, key=camera.key)
    wait_until(lambda: pilot.received or "does not prove" in pilot.problem, "what is wrong is said")
    assert not pilot.received


def test_a_robot_makes_the_pilots_machine_send_to_somebody_else(open_camera: Service, watch: Callable) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as victim:
        victim.bind((ELSEWHERE, 0))
        victim.settimeout(0.5)
        target = "{} {} typ".format(*victim.getsockname()).encode()
        watch(open_camera, lambda status, headers, body: (
            status, headers, re.sub(rb"127\.0\.0\.1 \d+ typ", target, body)
        ))  # fmt: skip
        with pytest.raises(TimeoutError):
            victim.recv(2000)


def test_a_robot_sends_the_pilots_machine_to_another_address(open_camera: Service, watch: Callable) -> None:
    with socket.create_server((ELSEWHERE, 0)) as victim:
        victim.settimeout(0.5)
        elsewhere = "http://{}:{}/camera".format(*victim.getsockname())
        watch(open_camera, lambda *_: (307, {"Location": elsewhere}, b""))
        with pytest.raises(TimeoutError):
            victim.accept()


def test_a_robot_writes_to_the_pilots_terminal(open_camera: Service, watch: Callable, wait_until: Callable) -> None:
    pilot = watch(open_camera, lambda *_: (503, {}, b"\x1b]0;title\x07busy\r\n"))
    wait_until(lambda: "busy" in pilot.problem, "why there is no picture is said")
    assert pilot.problem.isprintable()


def test_a_robots_pictures_cost_the_pilot_gigabytes() -> None:
    """A few bytes of VP8 say that a picture is 16383 x 16383."""
    environment = {**os.environ, "PYTHONPATH": ":".join(map(str, SOURCES))}
    command = [sys.executable, str(Path(__file__).with_name("huge_pictures.py")), "1.5"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    _, megabytes, connections = done.stdout.split()
    assert int(connections) >= 1, done.stderr
    assert int(megabytes) < 200
