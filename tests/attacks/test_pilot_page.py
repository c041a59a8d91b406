"""Attacks on the pilot's page: by strangers without a way in, by people whose way in is over, by watchers, by pages of
somebody else's in the pilot's browser, and by floods. The page's program, drive_lease and the ROS graph are real; a
pilot drives meanwhile, and goes on."""

from __future__ import annotations

import contextlib
import dataclasses
import getpass
import itertools
import json
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from attacked_pages import Attacker, Browser, Program
from channel_flood import FLOODS, is_hung_up_on
from cheap_passwords import CHEAP
from endings import end_together
from page_browser import FLAGS, PICTURES
from page_stranger import FORWARD, ZERO, Pilot, Stranger, ask, drive
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Frame, Opcode
from websockets.sync.client import ClientConnection

from pepper_sim.tablet.devtools import DevTools
from telepresence.page.app import MOST_BODY
from telepresence.page.attempts import MOST, PERIOD
from telepresence.page.browser_messages import MOST_PER_SECOND
from telepresence.page.commands import REQUESTS
from telepresence.page.tabs import DIALS, MOST_LINKS
from telepresence.station import processes
from telepresence.station.pilot_page import PILOT_PAGE_KEY
from telepresence.station.ros_master import master_answers
from telepresence.teleop.accounts import TRIES as FREE_TRIES
from telepresence.teleop.accounts import Users
from telepresence.teleop.invitations import Invitations, beside

pytestmark = [pytest.mark.ros, pytest.mark.browser]

ROOT = Path(__file__).resolve().parents[2]
PASSWORD = "correct horse"
KEY = "of the link that is printed"
GROWTH = 12.0
"""[MB] that a flood may leave behind: less than a tenth of what it sent."""
LOST = 2
"""How often the pilot may lose the robot to nobody: a busy machine holds up programs for longer than a lease lasts."""
SILENCE = 5.0
"""[s] for which the page may tell the pilot nothing: more than a busy machine holds it up."""
PROMPT = 0.5
"""[s] for which a flood may keep the page from telling the pilot anything: several of the periods in which it does."""
TRIES = 4
"""The best of so many floods, as other programs hold up those of a busy machine."""
HELD_ON = 10.0
"""[s] after which a flood counts as one that the page puts up with."""
SOCKET = "/ws?robot=Pepper&page=0000000000000001&attempt=1"
HOME = "{}nothing"
"""An address of the page's origin without the page: that would take the robot itself."""
FACTS = (b"Pepper", b"anna", b"pilot_page")
"""What a stranger must not learn."""


@dataclasses.dataclass
class Station:
    """A robot that is but its topics, its drive_lease and its page; anna has an account, will and wendy have one for
    watching."""

    stranger: Stranger
    invitations: Invitations
    page: Program
    probe: Callable[..., object]
    anna: str
    will: str

    def guest(self, role: str = "pilot") -> str:
        _, token = self.invitations.make(role, 3600.0)
        return self.stranger.enter(name="Lena", invitation=token)

    def velocities(self) -> list[list[float]]:
        return [fields for _, fields in self.probe("seen", "/cmd_vel")]

    def forget(self) -> None:
        self.probe("forget", "/cmd_vel")


@pytest.fixture(scope="module")
def station(tmp_path_factory, free_port, wait_until) -> Iterator[Station]:
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    uri = f"http://127.0.0.1:{port}"
    environment = {**os.environ, "ROS_MASTER_URI": uri, "ROS_HOME": str(folder / "ros"), "ROS_IP": "127.0.0.1"}
    users = Users(folder / "users.db", CHEAP)
    users.add("anna", PASSWORD, "pilot")
    for name in ("will", "wendy"):
        users.add(name, PASSWORD, "watcher")
    programs = ROOT / "catkin_ws/devel/lib"
    quiet = {"env": environment, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [processes.start(["rosmaster", "--core", "-p", str(port)], **quiet)]
    wait_until(lambda: master_answers(uri), "the ROS master answers")
    started.append(processes.start([str(programs / "avatar_gui/drive_lease"), f"_users:={users.path}"], **quiet))
    started.append(processes.start([sys.executable, "-c", PICTURES], **quiet))
    page = start_page(folder, uri, "--port", str(free_port()), "--users", str(users.path))
    probing = processes.start(
        [sys.executable, str(ROOT / "tests/catkin_ws/ros_probe.py")],
        env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip

    def probe(name: str, *arguments: object) -> object:
        probing.stdin.write(json.dumps([name, arguments]) + "\n")
        probing.stdin.flush()
        return json.loads(probing.stdout.readline())

    probe("watch", "/cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"])
    stranger = Stranger(page.url)
    anna, will = (stranger.enter(name=name, password=PASSWORD) for name in ("anna", "will"))
    assert anna and will
    yield Station(stranger, Invitations(beside(users.path)), page, probe, anna, will)
    page.close()
    end_together([*started, probing])


def start_page(folder: Path, uri: str, *words: str, **environment: str) -> Program:
    """Start the page's program at this ROS master."""
    program = str(ROOT / "catkin_ws/devel/lib/pilot_page/pilot_page")
    return Program(
        folder, program, *words, "--certificates", str(folder / "tls"), says=r"(https://[\d.]+:\d+/)",
        ROS_MASTER_URI=uri, ROS_HOME=str(folder / "ros"), ROS_IP="127.0.0.1", **environment,
    )  # fmt: skip


@pytest.fixture(scope="module")
def keyed(tmp_path_factory, free_port, wait_until) -> Iterator[Stranger]:
    """The page of a station where nobody signs in, which `./stack up` has given a key."""
    folder, port = tmp_path_factory.mktemp("keyed"), free_port()
    uri = f"http://127.0.0.1:{port}"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    master = processes.start(["rosmaster", "--core", "-p", str(port)], **quiet)
    wait_until(lambda: master_answers(uri), "the ROS master answers")
    words = ["--sign-in", "false", "--port", str(free_port()), "--users", str(folder / "users.db")]
    page = start_page(folder, uri, *words, **{PILOT_PAGE_KEY: KEY})
    yield Stranger(page.url)
    page.close()
    end_together([master])


@pytest.fixture
def pilot(station, wait_until) -> Iterator[Pilot]:
    """Anna drives; at the end nobody else has had the robot, she drives, and the page's program has not grown."""
    station.forget()
    with Pilot(station.stranger, station.anna) as pilot:
        drives = lambda: pilot.had[-1:] == ["I"] and station.velocities()[-5:] == [FORWARD] * 5  # noqa: E731
        wait_until(drives, "anna drives")
        pilot.had.clear()
        pilot.silence = 0.0
        station.forget()
        before = station.page.memory()
        yield pilot
        station.forget()
        wait_until(lambda: station.velocities()[-5:] == [FORWARD] * 5, "anna still drives")
        had = list(pilot.had)
        assert "another" not in had
        assert sum(pair == ("I", "nobody") for pair in itertools.pairwise(had)) <= LOST, had
        assert pilot.silence < SILENCE and pilot.pictures > 0
        assert station.page.memory() - before < GROWTH


@pytest.fixture
def driven(station, pilot) -> Station:
    """A robot that anna drives, see `pilot`."""
    return station


def test_who_has_a_way_in_sees_and_drives(driven):
    """No attack: it shows that the others fail for want of a way in."""
    assert driven.stranger.ask("GET", "/me", cookie=driven.anna)[0] == 200
    assert driven.stranger.ask("GET", "/me", cookie=driven.guest())[0] == 200


# --- without a session -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("people_sign_in", [True, False], ids=["people sign in", "nobody signs in"])
@pytest.mark.parametrize("cookie", ["", "x" * 43, "changed", "of another program"])
@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/me"), ("GET", "/servers"), ("GET", SOCKET), ("GET", "/invitations"), ("POST", "/offer"),
        ("POST", "/stop"), ("POST", "/invite"), ("POST", "/withdraw"), ("POST", "/leave"),
    ],
)  # fmt: skip
def test_somebody_without_a_session_asks(station, keyed, method, path, cookie, people_sign_in):
    cookies = {"changed": station.anna[:-1] + "!", "of another program": "../" * 14}
    body = {"robot": "Pepper", "page": "0" * 16, "attempt": 1, "sdp": "v=0"} if method == "POST" else None
    stranger = station.stranger if people_sign_in else keyed
    status, answer, got = stranger.ask(method, path, body, cookies.get(cookie, cookie))
    assert status == 401 and not got
    assert not any(fact in answer for fact in FACTS)


@pytest.mark.parametrize("name", ["", "Ben", getpass.getuser()])
@pytest.mark.parametrize("way", [{"password": ""}, {"password": KEY}, {"invitation": ""}, {"invitation": KEY[:-1]}])
def test_another_user_of_the_computer_comes_in_where_nobody_signs_in(keyed, name, way):
    sender = f"127.0.1.{len(name) + 1}"  # whose tries are limited
    status, answer, got = keyed.ask("POST", "/enter", {"name": name} | way, sender=sender)
    assert status == 403 and not got
    assert not any(fact in answer for fact in FACTS)


def test_who_has_the_link_comes_in_where_nobody_signs_in(keyed):
    """No attack: it shows that the others fail for want of the link."""
    cookie = keyed.enter(name="", invitation=KEY)
    assert keyed.ask("GET", "/me", cookie=cookie)[0] == 200


@pytest.mark.parametrize("path", ["/", "/nothing", "/static/nothing.js", "/static/../app.py", "/../sign_ins", "/video"])
def test_somebody_without_a_session_learns_something_from(station, path):
    _, answer, _ = station.stranger.ask("GET", path)
    assert not any(fact in answer for fact in (*FACTS, b"HKDF"))


# --- links -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "wrong", ["ended", "used", "withdrawn", "of more", "for longer", "cut", "longer", "nothing", "in the query"]
)
def test_a_link_opens_the_page_that_is(station, wrong):
    made, token = station.invitations.make("watcher", 3600.0, once=True)
    query = ""
    if wrong == "ended":
        token = station.invitations.make("pilot", 60.0, now=time.time() - 61.0)[1]
    elif wrong == "used":
        assert station.stranger.enter(name="Lena", invitation=token)
    elif wrong == "withdrawn":
        station.invitations.withdraw(made.id)
    elif wrong == "in the query":
        query, token = f"?i={token}", ""
    else:
        other = station.invitations.make("pilot", 7200.0)[1]
        token = {
            "of more": token[:22] + other[22:],
            "for longer": other[:22] + token[22:],
            "cut": token[:-1],
            "longer": token + "A",
            "nothing": "",
        }[wrong]
    status, _, got = station.stranger.ask(
        "POST", f"/enter{query}", {"name": "Eve", "invitation": token}, sender="127.0.0.9"
    )
    assert status in (403, 429) and not got


def test_a_guest_stays_whose_link_was_withdrawn(station, wait_until):
    made, token = station.invitations.make("pilot", 3600.0)
    cookie = station.stranger.enter(name="Lena", invitation=token)
    station.forget()
    with Pilot(station.stranger, cookie) as guest:
        wait_until(lambda: station.velocities()[-5:] == [FORWARD] * 5, "the guest drives")
        station.invitations.withdraw(made.id)
        wait_until(lambda: guest.hung_up, "the page hangs up")
        wait_until(lambda: station.velocities()[-1] == ZERO, "the robot stands")
    assert station.stranger.ask("GET", "/me", cookie=cookie)[0] == 401


# --- who may watch ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("who", ["an account", "a link"])
def test_a_watcher_drives_by_its_own_program(driven, who):
    cookie = driven.will if who == "an account" else driven.guest("watcher")
    sideways = [0.0, 0.3, 0.0]
    actions = [action for action in REQUESTS if action != "stop"]
    with driven.stranger.open(cookie) as socket:
        for number in range(1, 30):
            socket.send(drive(number, sideways))
            socket.send(
                ask(number, actions[number % len(actions)], "" if actions[number % len(actions)] == "give" else None)
            )
            time.sleep(0.02)
        socket.send(drive(2**50, sideways, sent=1e9))
        time.sleep(0.3)  # in which it may not drive
    assert sideways not in driven.velocities()


@pytest.mark.parametrize("path", ["/invite", "/withdraw", "/invitations"])
@pytest.mark.parametrize("who", ["will", "a guest"])
def test_somebody_invites_who_may_not(station, who, path):
    made, _ = station.invitations.make("watcher", 3600.0)
    cookie = station.will if who == "will" else station.guest()
    body = {"/invite": {"role": "pilot", "hours": 1, "once": False}, "/withdraw": {"id": made.id}}.get(path)
    assert station.stranger.ask("POST" if body else "GET", path, body, cookie)[0] == 403
    assert made in station.invitations.all()


def test_guests_of_one_link_take_every_place(driven):
    """Who has an account comes in all the same, and a guest has to go for it."""
    _, token = driven.invitations.make("watcher", 3600.0)
    with contextlib.ExitStack() as opened:
        for number in range(MOST_LINKS):
            cookie = driven.stranger.enter(name="Eve", invitation=token)
            with contextlib.suppress(InvalidStatus, ConnectionClosed):  # anna has a place, and the page may hang up
                opened.enter_context(driven.stranger.open(cookie)).send(drive(number + 1, None))
        with driven.stranger.open(driven.will) as socket:
            assert "state" in next(text for text in socket if isinstance(text, str))


# --- pages of somebody else's ----------------------------------------------------------------------------------------

FOREIGN = [
    {"Origin": "https://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://127.0.0.1"},
    {"Sec_Fetch_Site": "cross-site"},
    {"Sec_Fetch_Site": "same-site"},
    {"Host": "evil.example"},
    {"Host": "127.0.0.1.evil.example"},
]


@pytest.mark.parametrize("headers", FOREIGN, ids=lambda one: " ".join(next(iter(one.items()))))
def test_another_page_asks_with_the_pilot_s_cookie(station, headers):
    requests = (
        ("GET", "/", None),
        ("GET", "/me", None),
        ("POST", "/enter", {"name": "anna", "password": PASSWORD}),
        ("POST", "/stop", {"robot": "Pepper", "page": "0" * 16}),
        ("POST", "/invite", {"role": "pilot", "hours": 1, "once": False}),
        ("GET", SOCKET, None),
    )
    for method, path, body in requests:
        status, answer, got = station.stranger.ask(method, path, body, station.anna, **headers)
        assert status == 403 and not got and not any(fact in answer for fact in FACTS)


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "https://127.0.0.1:1"])
def test_another_page_opens_the_websocket_with_the_pilot_s_cookie(station, origin):
    with pytest.raises(InvalidStatus):
        station.stranger.open(station.anna, origin)


class PilotsBrowser(Browser):
    """In which anna is signed in, and evil.example open."""

    def __init__(self, wait_until: Callable) -> None:
        rules = "--host-resolver-rules=MAP evil.example 127.0.0.1,MAP rebound.example 127.0.0.1"
        self.tools = DevTools(flags=(*FLAGS, rules))
        self._wait_until = wait_until
        for domain in ("Page", "Runtime"):
            self.tools.call(f"{domain}.enable")


@pytest.fixture(scope="module")
def pilots(station, wait_until) -> Iterator[PilotsBrowser]:
    browser = PilotsBrowser(wait_until)
    browser.open(HOME.format(station.page.url))
    enter = f"fetch('/enter', {{method: 'POST', body: JSON.stringify({{name: 'anna', password: '{PASSWORD}'}})}})"
    assert browser.run(f"{enter}.then((answer) => answer.status)") == 200
    assert browser.run("fetch('/me').then((answer) => answer.status)") == 200
    yield browser
    browser.tools.close()


@pytest.fixture(scope="module")
def evil() -> Iterator[Attacker]:
    attacker = Attacker()
    yield attacker
    attacker.close()


@pytest.mark.parametrize(
    "script",
    [
        pytest.param("fetch(PAGE + 'me', {credentials: 'include'}).then((a) => a.text())", id="reads who it is"),
        pytest.param(
            "fetch(PAGE + 'stop', {method: 'POST', credentials: 'include', mode: 'no-cors',"
            " body: '{\"robot\": \"Pepper\", \"page\": \"0000000000000000\"}'}).then((a) => a.type + a.status)",
            id="presses the red stop",
        ),
        pytest.param(
            "new Promise((done) => { const socket = new WebSocket(PAGE.replace('https', 'wss') +"
            " 'ws?robot=Pepper&page=0000000000000000'); socket.onopen = () => done('open');"
            " socket.onmessage = (event) => done('got ' + event.data); socket.onerror = () => done(''); })",
            id="opens the websocket",
        ),
        pytest.param(
            "import(PAGE + 'static/link.js').then((module) => Object.keys(module).join())", id="imports a module"
        ),
        pytest.param(
            "new Promise((done) => { const frame = document.createElement('iframe'); frame.src = PAGE;"
            " frame.onload = () => { try { done(frame.contentDocument.title); } catch (error) { done(''); } };"
            " document.body.append(frame); setTimeout(() => done(''), 3000); })",
            id="frames the page",
        ),
    ],
)  # fmt: skip
def test_a_page_in_the_pilot_s_browser(station, pilots, evil, script):
    pilots.open(f"http://evil.example:{evil.server_port}/")
    got = pilots.run(
        f"const PAGE = '{station.page.url}'; Promise.resolve({script}).catch((error) => '')".replace("const", "var")
    )
    assert got in ("", "opaque0", None)
    assert pilots.frames() == []
    pilots.open(HOME.format(station.page.url))
    assert pilots.run("fetch('/me').then((answer) => answer.status)") == 200


def test_a_page_in_the_pilot_s_browser_sends_a_form(station, pilots, evil, wait_until):
    pilots.open(f"http://evil.example:{evil.server_port}/")
    address = f"{station.page.url}stop"
    pilots.run(
        f"var form = Object.assign(document.createElement('form'), {{method: 'post', action: '{address}',"
        " enctype: 'text/plain'});"
        "form.append(Object.assign(document.createElement('input'),"
        ' {name: \'{"robot": "Pepper", "page": "0000000000000000", "x\', value: \'": ""}\'}));'
        "document.body.append(form); form.submit()"
    )
    wait_until(lambda: pilots.shows(f"location.href == {json.dumps(address)}"), "the form is sent")
    assert "reason" in pilots.run("document.body.innerText")
    pilots.open(HOME.format(station.page.url))


def test_a_name_that_suddenly_leads_here(station, pilots):
    """DNS rebinding: evil.example has the page's address, and its page reads as of its own origin."""
    parts = station.stranger
    pilots.open(f"https://rebound.example:{parts.port}/me")
    assert "not called" in pilots.run("document.body.innerText")
    pilots.open(HOME.format(station.page.url))


# --- floods ----------------------------------------------------------------------------------------------------------


def test_ten_thousand_wrong_passwords_and_links(driven):
    """From five addresses; few of them are even looked at."""
    words = [
        json.dumps({"name": f"anna{n}", "password": "x" * 8} if n % 2 else {"name": "x", "invitation": f"{n:043}"})
        for n in range(2000)
    ]
    begin = time.monotonic()
    with ThreadPoolExecutor(5) as threads:
        found = sum(threads.map(lambda n: driven.stranger.flood(words, f"127.0.0.{n}"), range(20, 25)), Counter())
    periods = 1.0 + (time.monotonic() - begin) / PERIOD
    assert found.total() == 10_000 and set(found) == {403, 429}
    assert found[403] <= 5 * MOST * (periods + 1.0)


def test_wrong_passwords_for_one_name(driven, wait_until):
    """From one address, as fast as they are answered: they delay that name, and nobody else."""

    def seconds() -> float:
        begin, fields = time.monotonic(), {"name": "wendy", "password": PASSWORD}
        enters = lambda: driven.stranger.ask("POST", "/enter", fields, sender="127.0.0.31")[0] == 200  # noqa: E731
        wait_until(enters, "wendy comes in")  # again and again: a busy disk may lock the accounts
        return time.monotonic() - begin

    def status(number: int) -> int:
        fields = {"name": f"mallory{number}", "password": "x" * 8}
        return driven.stranger.ask("POST", "/enter", fields, sender=f"127.0.0.{40 + number}")[0]

    pairs: list[tuple[float, float]] = []  # s, without and with the attack
    while not any(disturbed < 3.0 * undisturbed + 2.0 for undisturbed, disturbed in pairs):
        assert len(pairs) < TRIES, f"wendy waits: {pairs}"
        undisturbed = max(seconds() for _ in range(2))
        with ThreadPoolExecutor(MOST) as threads:
            tries = [threads.submit(status, len(pairs)) for _ in range(MOST)]
            wait_until(lambda tries=tries: sum(one.done() for one in tries) >= FREE_TRIES, "the others wait")
            pairs.append((undisturbed, max(seconds() for _ in range(2))))
            assert {one.result() for one in tries} <= {403, 429}


def test_offers_without_end(driven):
    cookie = driven.guest("watcher")
    body = {"robot": "Pepper", "page": "0" * 16, "sdp": "v=0\r\n" + "a=x\r\n" * 5_000}
    statuses = Counter(
        driven.stranger.ask("POST", "/offer", body | {"attempt": attempt}, cookie)[0] for attempt in range(1, 101)
    )
    assert set(statuses) == {400, 429} and statuses[400] <= 2 * DIALS[0]


@pytest.mark.parametrize("size", [MOST_BODY + 1, 5_000_000])
@pytest.mark.parametrize("path", ["/enter", "/offer"])
def test_a_giant_request(driven, path, size):
    cookie = driven.guest("watcher")
    with contextlib.suppress(OSError):  # it hangs up before it has all of it
        assert driven.stranger.ask("POST", path, b"[" * size, cookie)[0] in (400, 413)


@pytest.mark.parametrize("message", ["x" * 10_000_000, b"x" * 10_000_000, "drive " + "[" * 1200], ids=range(3))
def test_giant_messages(driven, message):
    with driven.stranger.open(driven.guest("watcher")) as socket, contextlib.suppress(ConnectionClosed):
        for _ in range(3):
            socket.send(message)
        socket.send(drive(1, None))
        time.sleep(0.2)  # in which the page may not die of it


@pytest.mark.parametrize(
    "frame",
    [
        *(
            Frame(Opcode.TEXT, text.encode())
            for text in ("drive x", drive(1), ask(1, "take"), "nothing at all", "seen")
        ),
        *(Frame(opcode, b"\0") for opcode in (Opcode.BINARY, Opcode.PING, Opcode.PONG)),
    ],
    ids=lambda frame: f"{frame.opcode.name} {frame.data[:5].decode()}".rstrip(" \0"),
)
def test_messages_without_end(driven, pilot, wait_until, frame):
    """Of whatever kind: they are not anna's delay, and who has sent them does not do it again at once."""
    silences: list[float] = []  # s
    while not any(seconds < PROMPT for seconds in silences):
        assert len(silences) < TRIES, f"the page told anna nothing for {silences} s"
        cookie = driven.guest("watcher")
        with driven.stranger.open(cookie) as socket:
            pilot.silence = 0.0
            assert hangs_up_on(socket, frame)
        heard = len(pilot.had)
        with pytest.raises(InvalidStatus, match="429"):
            driven.stranger.open(cookie)
        wait_until(lambda heard=heard: len(pilot.had) > heard, "anna hears of the robot")
        silences.append(pilot.silence)


@pytest.mark.parametrize("flood", FLOODS)
def test_pieces_of_messages_by_webrtc(driven, pilot, flood):
    """They fill no memory: a page that has lost nothing waits for few."""
    cookie = driven.guest("watcher")
    assert is_hung_up_on(driven.stranger, cookie, flood, HELD_ON)
    assert (
        driven.stranger.ask("POST", "/offer", {"robot": "Pepper", "page": "0" * 16, "attempt": 1, "sdp": ""}, cookie)[0]
        == 429
    )


def test_stops_without_end(driven, pilot, wait_until):
    """Whoever is signed in may stop the robot, and who ranks higher resets the stop."""
    with driven.stranger.open(driven.guest("watcher")) as socket:
        assert hangs_up_on(socket, Frame(Opcode.TEXT, ask(1, "stop").encode()))
    wait_until(lambda: driven.velocities()[-1:] == [ZERO], "the robot stands")

    def reset() -> bool:
        pilot.ask("reset_stop")  # again and again: another stop may have been on its way
        return driven.velocities()[-5:] == [FORWARD] * 5

    wait_until(reset, "anna resets the stop")


def hangs_up_on(socket: ClientConnection, frame: Frame) -> bool:
    """Whether the page hangs up on who sends a frame without end, and now and then a sign of life."""
    many = frame.serialize(mask=True) * 2 * MOST_PER_SECOND
    deadline = time.monotonic() + HELD_ON
    with contextlib.suppress(ConnectionClosed, OSError):
        for number in itertools.count(1):
            socket.socket.sendall(many)
            socket.send(drive(number, None))
            if time.monotonic() > deadline:
                return False
    return True
