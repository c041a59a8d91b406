"""Other users of the pilot's computer, and a page in the pilot's browser, attack web pages and simulated robots.

Each test is an attack, and must fail as such.
"""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import secrets
import shutil
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from attacked_pages import ROOT, Attacker, Browser, Program

from telepresence.naoqi.session import Session
from telepresence.station.virtual_display import VirtualDisplay

pytestmark = [pytest.mark.browser, pytest.mark.x11]

KEY = secrets.token_urlsafe(16)
BURST = 8
"""Lines that a program may write at once, when something goes wrong for the first time."""
OFF = [False] * 8
"""The simulated Robotino's digital outputs before each attack."""


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Program]:
    """The page with the picture of the operator's window, as `./stack up` starts it where there is no screen."""
    display = VirtualDisplay(320, 240)
    words = [sys.executable, "-m", "telepresence.station.screen_page", str(display.folder), "--port=0"]
    program = Program(tmp_path_factory.mktemp("screen"), *words, says=r"listening on (\S+)")
    yield program
    program.close()
    display.close()


@pytest.fixture(scope="module")
def camera(tmp_path_factory: pytest.TempPathFactory, free_port: Callable, wait_until: Callable) -> Iterator[Program]:
    """The page that shows a robot's camera where there is no screen; com_cam's is made of the same parts."""
    words = [sys.executable, "-m", "telepresence_1.rob_cam_node", "127.0.0.1", str(free_port()), "--page-port=0"]
    paths = os.pathsep.join(str(path) for path in (ROOT / "catkin_ws" / "src").glob("*/src"))
    environment = {"DISPLAY": "", "PYTHONPATH": os.pathsep.join((paths, os.environ["PYTHONPATH"]))}
    program = Program(
        tmp_path_factory.mktemp("camera"),
        *("sh", "-c", 'exec "$@" 2>&1', "sh", *words),
        says=r"look at (\S+) instead",
        TELEPRESENCE_PAGE_KEY=KEY,
        **environment,
    )
    program.query = f"k={KEY}"
    wait_until(lambda: program.ask(program.with_key("/frame.jpg"))[0] == 200, "there is a picture")
    yield program
    program.close()


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Program]:
    """A simulated Robotino."""
    words = [sys.executable, "-m", "robotino_sim", "--port=0", "--scene=empty"]
    program = Program(tmp_path_factory.mktemp("robot"), *words, says=r"listening on (\S+)")
    yield program
    program.close()


@pytest.fixture(scope="module")
def owner(tmp_path_factory: pytest.TempPathFactory, free_port: Callable) -> Iterator[Program]:
    """The page of a simulated Pepper's owner; `naoqi_port` is where programs reach the robot."""
    port = free_port()
    words = [sys.executable, "-m", "pepper_sim", f"--port={port}", "--scene=empty", "--page-port=0"]
    program = Program(
        tmp_path_factory.mktemp("owner"), *words, says=r"owner's page (\S+)", TELEPRESENCE_ROBOT_PAGE_KEY=KEY
    )
    program.naoqi_port = port
    yield program
    program.close()


# --- another user of the machine, with a program of his own --------------------------------------------------------

SCREEN_PATHS = ("/", "/screen.mjpeg")
CAMERA_PATHS = ("/", "/frame.jpg", "/video_feed", "/status")


def test_who_has_the_printed_address_sees_the_pages(screen, camera):
    """No attack: it shows that the others fail for want of the key."""
    assert screen.ask(screen.with_key("/screen.mjpeg"))[0] == 200
    assert camera.ask(camera.with_key("/status"))[0] == 200


@pytest.mark.parametrize("path", SCREEN_PATHS)
def test_another_user_opens_the_windows_picture(screen, path):
    assert screen.ask(path)[0] == 403


@pytest.mark.parametrize("path", CAMERA_PATHS)
def test_another_user_opens_the_cameras_page(camera, path):
    assert camera.ask(path)[0] == 403


@pytest.mark.parametrize("page", ["screen", "camera"])
def test_another_user_tries_keys_out(page, request):
    """Wrong ones are limited, and the limit does not keep out who has the right one, from the same address."""
    page = request.getfixturevalue(page)
    path = "/screen.mjpeg" if page.port == request.getfixturevalue("screen").port else "/status"
    statuses = [page.ask(f"{path}?k={number:022}")[0] for number in range(20)]
    assert set(statuses) == {403, 429} and statuses[-1] == 429
    assert page.ask(page.with_key(path))[0] == 200


@pytest.mark.parametrize("page", ["screen", "camera"])
def test_another_name_leads_to_the_page(page, request):
    """DNS rebinding, with the key even."""
    page = request.getfixturevalue(page)
    for host in ("evil.example", f"evil.example:{page.port}", "127.0.0.1.evil.example", "localhost.evil.example"):
        assert page.ask(page.with_key("/status"), Host=host)[0] == 403


def test_another_user_finds_a_key_on_a_command_line(screen, camera):
    """Command lines can be read by everybody, environments only by their owner."""
    for program in (screen, camera):
        words = Path(f"/proc/{program.process.pid}/cmdline").read_text()
        assert program.query and program.query.partition("=")[2] not in words


# --- too much of everything -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def slow(screen: Program, robot: Program) -> Iterator[dict[str, list[socket.socket]]]:
    """Requests that never end, from before the other tests on: in the headers, in the body, after the answer."""
    beginnings = {
        "headers": b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-A: ",
        "body": b"PUT /data/omnidrive HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 300\r\n\r\n",
        "line": b"GET /",
    }
    clients = {kind: [screen.connect(), robot.connect()] for kind in beginnings}
    for kind, sockets in clients.items():
        for client in sockets:
            client.sendall(beginnings[kind])
            client.settimeout(20.0)
    ended = threading.Event()

    def drip() -> None:
        while not ended.wait(0.2):
            for client in (client for sockets in clients.values() for client in sockets):
                with contextlib.suppress(OSError):  # the server has closed it, as it shall
                    client.send(b"a")

    thread = threading.Thread(target=drip, name="drip")
    thread.start()
    yield clients
    ended.set()
    thread.join()
    for client in (client for sockets in clients.values() for client in sockets):
        client.close()


@pytest.mark.parametrize("page", ["screen", "robot"])
def test_a_thousand_half_requests_keep_others_out(page, request, slow):
    """The thousand and first client is answered at once, whatever the thousand wait for, and the log stays short."""
    page = request.getfixturevalue(page)
    before, begin = len(page.log.read_bytes()), time.monotonic()
    with contextlib.ExitStack() as opened:
        for _ in range(1000):
            client = opened.enter_context(page.connect())
            with contextlib.suppress(ConnectionError):  # it had to go for a later one already
                client.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-A: ")
        assert page.ask("/")[0] in (200, 403)  # the REST server shows its page to everybody
        answered = time.monotonic()
        client.setblocking(False)
        with pytest.raises(BlockingIOError):  # they still wait: nobody had to be waited for
            client.recv(1)
    lines = page.log.read_bytes()[before:].count(b"\n")
    assert lines <= BURST + 2 + (answered - begin), "a line a second"


@pytest.mark.parametrize("page", ["screen", "robot"])
def test_giant_headers_are_read(page, request):
    page = request.getfixturevalue(page)
    before = page.memory()
    with page.connect() as client:
        client.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        with contextlib.suppress(ConnectionError):
            for _ in range(99):
                client.sendall(b"X-A: " + b"a" * 65000 + b"\r\n")
            client.sendall(b"\r\n")
            answer = client.recv(4096)
            assert not answer or b" 431 " in answer
    assert page.memory() < before + 5.0


@pytest.mark.parametrize("page", ["screen", "robot"])
def test_a_giant_body_is_read(page, request):
    page = request.getfixturevalue(page)
    before, sent = page.memory(), 0
    with page.connect() as client:
        client.sendall(b"POST /data/omnidrive HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 999999999999\r\n\r\n")
        with contextlib.suppress(ConnectionError, TimeoutError):
            client.settimeout(2.0)
            while sent < 200_000_000:
                sent += client.send(bytes(1_000_000))
    assert sent < 100_000_000 and page.memory() < before + 5.0


@pytest.mark.parametrize("page", ["screen", "robot"])
def test_a_flood_of_nonsense_fills_the_log(page, request):
    page = request.getfixturevalue(page)
    before, begin = len(page.log.read_bytes()), time.monotonic()
    for nonsense in (
        b"\x16\x03\x01\x02\r\n\r\n",
        b"GET / HTTP/1\r\n\r\n",
        b"GET / HTTP/1.1\r\nContent-Length: x\r\n\r\n",
    ):
        for _ in range(60):
            with page.connect() as client, contextlib.suppress(ConnectionError):
                client.sendall(nonsense)
                client.recv(100)
    lines = page.log.read_bytes()[before:].count(b"\n")
    assert lines <= BURST + 2 + (time.monotonic() - begin), "a line a second"


# --- a page in the pilot's browser -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def attacker() -> Iterator[Attacker]:
    attacker = Attacker()
    yield attacker
    attacker.close()


@pytest.fixture(scope="module")
def pilot(tmp_path_factory: pytest.TempPathFactory, wait_until: Callable, screen, camera) -> Iterator[Browser]:
    """The pilot's browser, in which both pages were opened with their keys."""
    folder = tmp_path_factory.mktemp("bin")
    program = folder / "chromium"
    rules = '--host-resolver-rules="MAP evil.example 127.0.0.1,MAP rebound.example 127.0.0.1"'
    program.write_text(f'#!/bin/sh\nexec {shutil.which("chromium")} {rules} "$@"\n')
    program.chmod(0o755)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
        browser = Browser(wait_until)
    try:
        browser.places = []
        for page in (camera, screen):
            browser.open(f"http://{page.host}:{page.port}{page.with_key('/')}")
            browser.places.append(str(browser.run("location.href")))
        yield browser
    finally:
        browser.tools.close()


SITES = ("evil.example", "localhost", "127.0.0.1")
"""Where the attacking page is from: another site, and another port of what counts as the same site as the victims."""
SEEN = """new Promise(resolve => {{
  const image = new Image();
  const done = () => resolve(image.naturalWidth > 0);
  image.onload = image.onerror = done;
  image.src = {url};
  setTimeout(done, 1500);
}})"""

FRAME = """new Promise(resolve => {{
  const frame = document.createElement('iframe');
  frame.onload = resolve;
  frame.src = {url};
  document.body.append(frame);
}})"""
SOCKET = """new Promise(resolve => {{
  const socket = new WebSocket({url});
  socket.onopen = () => resolve(true);
  socket.onerror = () => resolve(false);
}})"""


def test_the_pilots_own_browser_shows_the_window(pilot, screen, wait_until):
    """No attack. The key has left the address."""
    wait_until(lambda: pilot.run(SEEN.format(url="document.images[0].src")) is True, "the picture is shown")
    assert not screen.query or screen.query not in pilot.places[1]


@pytest.mark.parametrize("site", SITES)
def test_a_page_shows_itself_the_pictures(pilot, attacker, screen, camera, site):
    """By an `<img>`, with the cookies that the browser has, even where it knows the whole address."""
    pilot.open(f"http://{site}:{attacker.server_port}/")
    urls = [f"http://127.0.0.1:{screen.port}/screen.mjpeg", f"http://127.0.0.1:{camera.port}/frame.jpg"]
    urls += [pilot.places[0] + "frame.jpg", pilot.places[1] + "screen.mjpeg"]
    assert not any(pilot.run(SEEN.format(url=json.dumps(url))) for url in urls)


def test_a_page_frames_the_pages(pilot, attacker, screen, camera):
    """To lead the pilot's clicks, or to have the keys' owner look at it there."""
    pilot.open(f"http://127.0.0.1:{attacker.server_port}/")
    for page, place in ((camera, pilot.places[0]), (screen, pilot.places[1])):
        for url in (place, f"http://127.0.0.1:{page.port}{page.with_key('/')}"):
            pilot.run(FRAME.format(url=json.dumps(url)))
    assert not [url for url in pilot.frames() if str(screen.port) in url or str(camera.port) in url]


def test_a_page_reads_the_pictures_under_another_name(pilot, screen, camera):
    """DNS rebinding: the page was loaded from rebound.example, which then leads to 127.0.0.1."""
    pilot.tools.call("Page.setBypassCSP", enabled=True)  # the attacker's page would have no policy
    for page, path in ((screen, "/screen.mjpeg"), (camera, "/frame.jpg")):
        pilot.open(f"http://rebound.example:{page.port}/nothing")
        assert pilot.run(f"fetch({json.dumps(page.with_key(path))}).then(answer => answer.ok)") is False
    pilot.tools.call("Page.setBypassCSP", enabled=False)


def test_a_server_on_another_port_is_sent_the_cookie(pilot, attacker, screen, camera):
    """Cookies know no ports: who lures the pilot to another server of this machine must not be sent the way in."""
    attacker.cookies.clear()
    pilot.open(f"http://127.0.0.1:{attacker.server_port}/")
    pilot.run("fetch('/', {credentials: 'include'}).then(answer => answer.text())")
    assert attacker.cookies and not any(attacker.cookies)


# --- the simulated Robotino -------------------------------------------------------------------------------------------

WAYS = {
    "fetch": """fetch({url}, {{
      method: 'POST', mode: 'no-cors', headers: {{'Content-Type': 'text/plain'}}, body: {body}
    }}).then(() => 0, () => 0)""",
    "beacon": "new Promise(r => {{ navigator.sendBeacon({url}, {body}); setTimeout(r, 200); }})",
    "form": """new Promise(resolve => {{
      const form = document.createElement('form'), field = document.createElement('input');
      const frame = document.createElement('iframe');
      frame.name = form.target = 'hidden';
      Object.assign(form, {{method: 'post', enctype: 'text/plain', action: {url}}});
      [field.name, field.value] = ['{{"num": 0, "val": true, "x": "', '"}}'];
      form.append(field);
      document.body.append(frame, form);
      frame.onload = resolve;
      form.submit();
      setTimeout(resolve, 1000);
    }})""",
}


CONSENT_WAYS = {
    "fetch": """fetch({url}, {{
      method: 'POST', mode: 'no-cors', credentials: 'include', body: new URLSearchParams('programs=1')
    }}).then(() => 0, () => 0)""",
    "beacon": "new Promise(r => {{ navigator.sendBeacon({url}, new URLSearchParams('programs=1')); "
    "setTimeout(r, 200); }})",
    "form": """new Promise(resolve => {{
      const form = document.createElement('form'), field = document.createElement('input');
      const frame = document.createElement('iframe');
      frame.name = form.target = 'hidden';
      Object.assign(form, {{method: 'post', action: {url}}});
      [field.name, field.value] = ['programs', '1'];
      form.append(field);
      document.body.append(frame, form);
      frame.onload = resolve;
      form.submit();
      setTimeout(resolve, 1000);
    }})""",
}


@pytest.fixture
def outputs(robot: Program) -> Callable[[], list[bool]]:
    """Reads the robot's digital outputs, which are all off; programs that are no browser switch and read them."""
    assert robot.ask("/data/digitaloutputarray", "PUT", json.dumps(OFF).encode())[0] == 200
    return lambda: json.loads(robot.ask("/data/digitaloutputstatus")[1])


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("site", SITES)
def test_a_page_commands_the_robot(pilot, attacker, robot, outputs, site, way):
    pilot.open(f"http://{site}:{attacker.server_port}/")
    url = json.dumps(f"http://127.0.0.1:{robot.port}/data/digitaloutput")
    pilot.run(WAYS[way].format(url=url, body="JSON.stringify({num: 0, val: true})"))
    assert outputs() == OFF


def test_a_page_drives_the_robot(pilot, attacker, robot):
    pilot.open(f"http://localhost:{attacker.server_port}/")
    before = json.loads(robot.ask("/data/odometry")[1])
    drive = WAYS["fetch"].format(url=json.dumps(f"http://127.0.0.1:{robot.port}/data/omnidrive"), body="'[0.3, 0, 0]'")
    pilot.run(f"{drive}.then(() => new Promise(r => setTimeout(r, 300)))")
    after = json.loads(robot.ask("/data/odometry")[1])
    assert abs(after[0] - before[0]) < 0.005


def test_a_program_calls_the_robot_by_another_name(robot, outputs):
    """No attack: nobody can lead a program here by DNS rebinding."""
    for host in ("robotino", f"lab.example:{robot.port}"):
        assert robot.ask("/data/odometry", Host=host)[0] == 200
        assert robot.ask("/data/odometry", Host=host, Origin=f"http://{host}")[0] == 403
        assert robot.ask("/data/odometry", Host=host, **{"Accept-Language": ""})[0] == 403
        body = json.dumps({"num": 0, "val": True}).encode()
        assert robot.ask("/data/digitaloutput", "POST", body, Host=host, Referer=f"http://{host}/")[0] == 403
    assert outputs() == OFF


def test_a_page_commands_the_robot_under_another_name(pilot, robot, outputs):
    """DNS rebinding: for the browser the robot's server is the page's own."""
    pilot.open(f"http://rebound.example:{robot.port}/data/odometry")
    pilot.run(WAYS["fetch"].format(url="'/data/digitaloutput'", body="JSON.stringify({num: 0, val: true})"))
    assert outputs() == OFF
    hidden = "headers: {'User-Agent': 'curl/8.0', 'Accept-Language': ''}, referrerPolicy: 'no-referrer'"
    for options in ("{}", f"{{{hidden}}}", f"{{{hidden}, credentials: 'omit', cache: 'no-store'}}"):
        assert pilot.run(f"fetch('/data/odometry', {options}).then(answer => answer.ok)") is False


def test_a_page_looks_through_the_robots_camera(pilot, attacker, robot):
    pilot.open(f"http://evil.example:{attacker.server_port}/")
    assert pilot.run(SEEN.format(url=json.dumps(f"http://127.0.0.1:{robot.port}/cam0"))) is False


def test_a_page_opens_a_web_socket(pilot, attacker, robot):
    pilot.open(f"http://evil.example:{attacker.server_port}/")
    url = json.dumps(f"ws://127.0.0.1:{robot.port}/data/odometry")
    assert pilot.run(SOCKET.format(url=url)) is False


# --- the simulated Pepper ---------------------------------------------------------------------------------------------


def greeting() -> bytes:
    """What a NAOqi client sends first, as it arrives at a port."""
    with socket.create_server(("127.0.0.1", 0)) as catcher:
        port = catcher.getsockname()[1]
        client = threading.Thread(target=_greet, args=(f"tcp://127.0.0.1:{port}",), name="client")
        client.start()
        connection, _ = catcher.accept()
        with connection:
            caught = connection.recv(65536)
        client.join()
    return caught


def _greet(endpoint: str) -> None:
    with contextlib.suppress(RuntimeError):  # nobody answers
        Session().connect(endpoint)


def test_a_post_from_a_page_makes_naoqi_calls(owner):
    """Its headers come before whatever its body holds: NAOqi must hang up instead of looking for the next message."""
    address = ("127.0.0.1", owner.naoqi_port)
    naoqi = greeting()
    head = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\n"
    padding = b"".join(b"x" * count + b"\r\n" for count in (0, *range(1, 28)))  # messages begin with 28 bytes
    for body in (naoqi, padding + naoqi * 28):
        with socket.create_connection(address, timeout=10.0) as client:
            client.sendall(head + b"Content-Length: %d\r\n\r\n" % len(body) + body)
            with contextlib.suppress(ConnectionError):
                assert client.recv(100) == b""
    with socket.create_connection(address, timeout=10.0) as client:
        client.sendall(naoqi)
        assert client.recv(100)[:4] == naoqi[:4], "without the headers it is answered"


FORM = {"Content-Type": "application/x-www-form-urlencoded"}


def consents(owner: Program) -> bool:
    """What the page says to whoever has its key."""
    return b"<strong>may</strong>" in owner.ask(owner.place)[1]


@pytest.fixture
def refusing(owner: Program) -> Iterator[None]:
    """The owner has opened the page and consents to nothing, before and after the attack."""
    with contextlib.closing(http.client.HTTPConnection(owner.host, owner.port, timeout=20.0)) as client:
        client.request("GET", owner.with_key("/"))
        answer = client.getresponse()
        owner.place = owner.with_key(answer.headers["Location"])
    assert not consents(owner)
    yield
    assert not consents(owner)


@pytest.mark.usefixtures("refusing")
@pytest.mark.parametrize("query", ["", "?k=", f"?k={'0' * 22}"])
def test_another_user_consents_without_the_key(owner, query):
    for path in ("/consent", owner.place.partition("?")[0] + "consent"):
        assert owner.ask(path + query, "POST", b"programs=1", **FORM)[0] == 403
    assert owner.ask(f"/{query}")[0] == 403


@pytest.mark.usefixtures("refusing")
def test_another_name_or_page_consents_with_the_key(owner):
    """DNS rebinding, and what browsers send with the forms of other pages, with the key even."""
    path = owner.with_key("/consent")
    for headers in (
        {"Host": f"evil.example:{owner.port}"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ):
        assert owner.ask(path, "POST", b"programs=1", **FORM, **headers)[0] == 403


@pytest.mark.usefixtures("refusing")
@pytest.mark.parametrize(
    ("site", "way"), [*((site, "form") for site in SITES), ("localhost", "fetch"), ("localhost", "beacon")]
)
def test_a_page_consents_in_the_owners_browser(pilot, attacker, owner, site, way):
    """In which the robot's page was opened, at the address that only the browser knows."""
    pilot.open(f"http://{owner.host}:{owner.port}{owner.with_key('/')}")
    place = str(pilot.run("location.href"))
    pilot.open(f"http://{site}:{attacker.server_port}/")
    pilot.run(CONSENT_WAYS[way].format(url=json.dumps(place + "consent")))


@pytest.mark.usefixtures("refusing")
def test_the_owner_consents_and_withdraws(pilot, owner, wait_until):
    """No attack: the buttons of the page work in a browser."""
    pilot.open(f"http://{owner.host}:{owner.port}{owner.with_key('/')}")
    for wanted, word in ((True, "may"), (False, "may not")):
        pilot.run("document.querySelector('button').click()")
        # The new page's button, not the old one's, is clicked next.
        wait_until(lambda word=word: pilot.run("document.querySelector('strong')?.textContent") == word, "it says so")
        assert consents(owner) is wanted


# --- at the end, when its time is over ------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["headers", "body", "line"])
def test_a_slow_request_stays_for_ever(slow, kind):
    """It was begun before the other tests and sends a byte from time to time."""
    for client in slow[kind]:
        with contextlib.suppress(ConnectionError):
            while client.recv(4096):
                pass
