"""A stranger attacks a Robotino's drive server, udp 8082, a Pepper's, udp 8085, and the pilot's end of their wire.

The drive server runs as on a robot, before a simulated robot's web server. Each test is one attack; it passes when the
attack fails.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import random
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import pytest
import qi
from attacked_drive_server import (
    ENVIRONMENT,
    HOST,
    ROOT,
    STYLES,
    Middle,
    Motion,
    Robot,
    Stranger,
    holding,
    port_of,
    standing,
    start_drive_server,
    wait,
)

from telepresence.drive.link import DriveLink
from telepresence.security.robot_key import RobotKey
from telepresence.station import processes

pytestmark = pytest.mark.slow

FREE = [9.87] * 72
"""What a forged report says about the way: it is free."""
FORGED_REPORT = {
    "type": "report", "stamp": 1e6, "seq": 1 << 50, "state": "clear", "reason": "", "given": [0, 0, 0],
    "allowed": FREE, "gap": None, "sector": -1, "command_age": 0.0, "scanning": False,
}  # fmt: skip


@pytest.fixture(scope="module")
def robot(tmp_path_factory) -> Iterator[Robot]:
    folder = tmp_path_factory.mktemp("robot")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(folder))
        made = Robot(folder)
        yield made
        made.close()


@pytest.fixture(autouse=True)
def nobody_drives(robot) -> None:
    robot.free()


@pytest.fixture
def closing() -> Iterator[contextlib.ExitStack]:
    with contextlib.ExitStack() as stack:
        yield stack


@pytest.fixture
def make_stranger(robot, closing):
    return lambda style, source=HOST: closing.enter_context(contextlib.closing(Stranger(robot.port, style, source)))


@pytest.fixture
def pilot(robot, closing) -> DriveLink:
    return closing.enter_context(contextlib.closing(robot.pilot()))


@pytest.fixture
def middle(robot, closing) -> Middle:
    return closing.enter_context(contextlib.closing(Middle(robot.port)))


@pytest.fixture
def overheard(robot, middle, closing) -> DriveLink:
    """A pilot whose datagrams go through the middle."""
    return closing.enter_context(contextlib.closing(robot.pilot(middle.port)))


@pytest.fixture(scope="module")
def pepper(robot, tmp_path_factory) -> Iterator[tuple[int, Motion]]:
    """Port and ALMotion of a Pepper whose drive server has the same key."""
    motion, session = Motion(), qi.Session()
    session.listenStandalone("tcp://127.0.0.1:0")
    session.registerService("ALMotion", motion)
    process = processes.start(
        [sys.executable, ROOT / "catkin_ws/src/naoqi_driver_py/robot/drive_server.py", "--port", "0",
         "--qi-url", session.endpoints()[0], "--key", robot.key],
        env=ENVIRONMENT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    yield port_of(process), motion
    processes.end(process, patience=10.0)
    process.stdout.close()
    session.close()


# --- to the robot ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("style", STYLES)
def test_eight_idle_sessions_block_the_pilot(robot, make_stranger, closing, style):
    """Places are for those who have proven the key. First of all, while no session of another test is left."""
    strangers = [make_stranger(style, f"127.0.0.{host}").enter(patient=False) for host in range(2, 11)]
    for stranger in strangers:
        stranger.say(type="drive", echo=0.0, after=0.0, velocity=None)
    closing.enter_context(contextlib.closing(link := DriveLink(f"{HOST}:{robot.port}")))
    end = time.monotonic() + 30.0
    while link.problem and time.monotonic() < end:
        for stranger in strangers:
            stranger.say(type="drive", echo=0.0, after=0.0, velocity=None)
        time.sleep(0.05)
    assert not link.problem


@pytest.mark.parametrize("style", STYLES)
def test_a_stranger_drives(robot, make_stranger, style):
    """Who has no key moves no wheel."""
    before = robot.simulation.robot.truth()[:2]
    make_stranger(style).enter().drive([0.2, 0.0, 0.0], 0.6)
    assert math.dist(before, robot.simulation.robot.truth()[:2]) < 0.005


@pytest.mark.parametrize("style", STYLES)
def test_a_stranger_drives_a_pepper(pepper, closing, style):
    """Nor Pepper's, neither by velocities nor by goals; what its pilot has stopped stays stopped."""
    port, motion = pepper
    stranger = closing.enter_context(contextlib.closing(Stranger(port, style))).enter()
    stranger.drive([0.2, 0.0, 0.0], 0.3)
    for _ in range(3):
        stranger.say(type="drive", echo=stranger.echo, after=0.0, velocity=None, goal={"id": 1, "pose": [1, 0, 0]})
    pilot = closing.enter_context(contextlib.closing(DriveLink(f"{HOST}:{port}")))
    wait(lambda: pilot.report()[0] and pilot.report()[0].state == "no command", "the pilot gets in all the same")
    assert motion.moves == []
    assert pilot.ask("stop").ok
    for number in range(3):
        stranger.say(type="ask", id=number, what="reset stop")
    seq = pilot.report()[0].seq
    wait(lambda: pilot.report()[0].seq >= seq + 4, "reports go on")
    assert pilot.report()[0].state == "stopped"
    assert pilot.ask("reset stop").ok


@pytest.mark.parametrize("style", STYLES)
def test_a_stranger_undoes_the_pilots_red_stop(robot, pilot, make_stranger, style):
    """What a pilot has stopped stays stopped."""
    assert pilot.ask("stop").ok
    stranger = make_stranger(style).enter()
    for number in range(3):
        stranger.say(type="ask", id=number, what="reset stop")
    robot.let_reports_pass()
    assert robot.state == "stopped"


@pytest.mark.parametrize("style", STYLES)
def test_a_stranger_presses_stop(robot, pilot, make_stranger, style):
    """Only pilots stop the robot through this port; everybody has the red button on its back."""
    with holding(pilot, 0.0, 0.1, 0.0):
        wait(lambda: robot.given[1] > 0.05, "the pilot drives")
        stranger = make_stranger(style).enter()
        stranger.say(type="ask", id=1, what="stop")
        robot.let_reports_pass()
        assert pilot.report()[0].state != "stopped"


@pytest.mark.parametrize("style", STYLES)
def test_a_stranger_blocks_the_pilot_with_zeros(robot, pilot, make_stranger, style):
    """Who drives is decided among those who have the key."""
    stranger = make_stranger(style).enter()
    stranger.drive([0.0, 0.0, 0.0], 0.3)
    over = threading.Event()

    def send() -> None:
        while not over.is_set():
            stranger.drive([0.0, 0.0, 0.0], 0.1)

    sender = threading.Thread(target=send)
    sender.start()
    try:
        with holding(pilot, 0.0, 0.1, 0.0):
            wait(lambda: robot.given[1] > 0.05, "the pilot drives")
            seq, given = robot.watcher.report()[0].seq, []
            while robot.watcher.report()[0].seq < seq + 20:
                given.append(robot.given[1])
                time.sleep(0.01)
    finally:
        over.set()
        sender.join()
    assert statistics.median(given) > 0.05, "it drives on, but for the moments in which the pilot is held up"


@pytest.mark.parametrize(
    "hello",
    [b'{"type":"hello"}', b"RTD2h" + bytes(11), b"RTD2h" + bytes(range(59)), b"RTD2o" + bytes(100), b"RTD2m", b"x"],
    ids=["JSON", "short hello", "hello", "open", "message", "anything"],
)
def test_a_small_question_sends_much_to_whoever_is_named_as_sender(robot, make_stranger, hello):
    """Before an address has proven that it is one, it gets no more than was sent in its name."""
    stranger = make_stranger("by JSON")
    stranger.send(hello)
    list(stranger.listen(0.4))
    assert stranger.received <= stranger.sent


def test_a_copy_of_the_pilots_datagram_from_another_address_counts(robot, middle, overheard, make_stranger):
    """What was overheard is of no use elsewhere."""
    with holding(overheard, 0.0, 0.1, 0.0):
        wait(lambda: robot.given[1] > 0.05, "the pilot drives")
        held = middle.seen["robot"][-1]
        middle.change = lambda to, datagram: None if to == "robot" else datagram
        stranger = make_stranger("by JSON", "127.0.0.2")

        def stands() -> bool:
            stranger.send(held)
            stranger.send(middle.seen["robot"][-1])
            return standing(robot)

        wait(stands, "the robot stands")
        list(stranger.listen(0.4))
        assert stranger.received == 0


def replayed(datagram: bytes) -> bytes:
    return datagram


def renumbered(datagram: bytes) -> bytes:
    """The datagram with a number that is higher than the pilot's."""
    if datagram.startswith(b"{"):
        fields = json.loads(datagram)
        if "id" in fields:
            fields["id"] += 1000
        else:
            fields["seq"] += 1000
        return json.dumps(fields).encode()
    return datagram[:13] + (1 << 40).to_bytes(8, "big") + datagram[21:]


@pytest.mark.parametrize("change", [replayed, renumbered])
def test_a_recorded_command_moves_the_robot_again(robot, middle, overheard, change):
    """A command counts once."""
    with holding(overheard, 0.0, 0.1, 0.0):
        wait(lambda: robot.given[1] > 0.05, "the pilot drives")
        recorded = middle.seen["robot"][-1]
        middle.change = lambda to, datagram: None if to == "robot" else datagram
        wait(lambda: standing(robot), "the robot stands")
    for _ in range(3):
        middle.send("robot", change(recorded))
    robot.let_reports_pass(3)
    assert standing(robot) and "late" not in robot.watcher.report()[0].reason


@pytest.mark.parametrize("change", [replayed, renumbered])
def test_a_recorded_reset_undoes_a_later_stop(robot, middle, overheard, change):
    """A request counts once."""
    assert overheard.ask("stop").ok and overheard.ask("reset stop").ok
    asks = [each for each in middle.seen["robot"] if not each.startswith(b"{") or b"reset stop" in each]
    assert overheard.ask("stop").ok
    for datagram in asks:
        middle.send("robot", change(datagram))
    robot.let_reports_pass()
    assert robot.state == "stopped"


def test_a_recorded_session_is_played_again_after_its_end(robot, middle, closing):
    """A session that has ended begins no second time: no reports, no place, no request."""
    link = robot.pilot(middle.port)
    assert link.ask("stop").ok and link.ask("reset stop").ok
    link.close()
    recorded = list(middle.seen["robot"])
    assert robot.watcher.ask("stop").ok
    newest = time.monotonic()
    # Until the robot has forgotten the session, and is not only held up.
    while time.monotonic() < newest + 2.5:
        known = len(middle.seen["pilot"])
        time.sleep(0.05)
        newest = time.monotonic() if len(middle.seen["pilot"]) > known else newest
    for datagram in recorded:
        middle.send("robot", datagram)
    robot.let_reports_pass()
    answers = middle.seen["pilot"][known:]
    assert robot.state == "stopped"
    assert all(len(answer) < 100 for answer in answers), "challenges, no reports"


def test_changed_digits_and_flipped_bits_change_what_the_pilot_commands(robot, middle, overheard):
    """Whatever happens to datagrams on their way, the robot does what the pilot wants, or nothing."""
    dice = random.Random(14)

    def flip(to: str, datagram: bytes) -> bytes:
        if to == "pilot" or dice.random() < 0.3:
            return datagram
        if dice.random() < 0.5:
            return datagram.replace(b"0.11", b"0.19")
        place = dice.randrange(len(datagram))
        return datagram[:place] + bytes([datagram[place] ^ 1 << dice.randrange(8)]) + datagram[place + 1 :]

    given = set()
    with holding(overheard, 0.0, 0.11, 0.0):
        wait(lambda: robot.given[1] > 0.05, "the pilot drives")
        middle.change = flip
        end = time.monotonic() + 2.0
        while time.monotonic() < end:
            given.add(robot.given)
            time.sleep(0.02)
    odd = {each for each in given if each[0] or each[2] or not 0.0 <= each[1] <= 0.1101}
    assert not odd


@pytest.mark.parametrize(
    "noise",
    [b"\x00noise", b'{"type":"drive","velocity":[NaN,0,0]}', b"RTD2m" + bytes(60)],
    ids=["bytes", "JSON", "message"],
)
def test_noise_in_the_pilots_name_stops_the_robot(robot, middle, overheard, noise):
    """What is not signed is nobody's, whatever address it comes from."""
    with holding(overheard, 0.0, 0.1, 0.0):
        wait(lambda: robot.given[1] > 0.05, "the pilot drives")
        seq, given = robot.watcher.report()[0].seq, []
        while robot.watcher.report()[0].seq < seq + 8:
            middle.send("robot", noise)
            given.append(robot.given[1])
            time.sleep(0.01)
        assert "refused" not in robot.watcher.report()[0].reason
        assert statistics.median(given) > 0.05, "it drives on, but for the moments in which the pilot is held up"


def test_mutated_datagrams_end_the_drive_server(robot, middle, overheard, make_stranger):
    """Several hundred changed, cut and joined datagrams, from the pilot's address and from another one."""
    dice = random.Random(9)
    assert overheard.ask("stop").ok and overheard.ask("reset stop").ok
    samples = list(middle.seen["robot"])
    stranger = make_stranger("by JSON", "127.0.0.3")
    for _ in range(400):
        sample = bytearray(dice.choice(samples))
        for _ in range(dice.randrange(1, 5)):
            kind, place = dice.randrange(4), dice.randrange(len(sample))
            if kind == 0:
                sample[place] ^= 1 << dice.randrange(8)
            elif kind == 1:
                del sample[place + 1 :]
            elif kind == 2:
                sample[place:place] = dice.randbytes(dice.randrange(8))
            else:
                sample += dice.choice(samples)
        stranger.send(bytes(sample[:1500]))
        middle.send("robot", bytes(sample[:1500]))
    robot.let_reports_pass(3)
    # Reports about the red stop may still be on their way on a busy machine.
    wait(lambda: robot.state == "no command", "nobody drives and nothing is stopped")
    assert robot.process.poll() is None
    with holding(overheard, 0.0, 0.05, 0.0):
        wait(lambda: robot.given[1] > 0.02, "the pilot still drives")


def test_a_flood_fills_the_log(robot, make_stranger):
    """Whatever comes, the drive server writes a line a second at most, and keeps deciding."""
    before, begun = robot.log.read_text().count("\n"), time.monotonic()
    stranger = make_stranger("by JSON").enter()
    seq = robot.watcher.report()[0].seq
    for number in range(3000):
        stranger.say(type="ask", id=number, what="leave")
        if number % 50 == 0:
            stranger.send(b"RTD2h" + os.urandom(59))
            time.sleep(0.001)
    wait(lambda: robot.watcher.report()[0].seq > seq + 5, "the drive server still decides")
    assert robot.log.read_text().count("\n") - before <= time.monotonic() - begun + 2


def test_another_pilot_undoes_a_stop(robot, closing):
    """A stop is reset by who pressed it, or by a higher rank."""
    first = closing.enter_context(contextlib.closing(robot.pilot(name="anna@desk")))
    second = closing.enter_context(contextlib.closing(robot.pilot(name="ben@sofa")))
    assert first.ask("stop").ok
    undone = second.ask("reset stop").ok
    first.ask("reset stop")
    assert not undone


def test_a_robot_without_a_key_listens_where_strangers_are(tmp_path):
    """Without a key nothing listens on any address but loopback, and what is missing is said."""
    process = start_drive_server(tmp_path / "log", "--robot", "127.0.0.1:9", "--address", "0.0.0.0")
    listens = process.stdout.readline()
    processes.end(process, patience=10.0)
    process.stdout.close()
    assert not listens and process.returncode == 1 and "--key" in (tmp_path / "log").read_text()


# --- to the pilot ----------------------------------------------------------------------------------------------------


def spoofed(_seen: list[bytes]) -> bytes:
    return json.dumps(FORGED_REPORT).encode()


def with_a_stolen_header(seen: list[bytes]) -> bytes:
    if seen[-1].startswith(b"{"):
        return spoofed(seen)
    return seen[-1][:13] + (1 << 40).to_bytes(8, "big") + seen[-1][21:37] + spoofed(seen)


@pytest.mark.parametrize("forge", [spoofed, with_a_stolen_header])
def test_one_report_makes_the_pilot_believe_that_the_way_is_free(middle, overheard, forge):
    """Reports are the robot's, or nobody's."""
    wait(lambda: len(middle.seen["pilot"]) > 5, "reports come")
    believed = []
    end = time.monotonic() + 0.3
    while time.monotonic() < end:
        middle.send("pilot", forge(middle.seen["pilot"]))
        time.sleep(0.01)
        believed.append(list(overheard.report()[0].allowed) == pytest.approx(FREE))
    assert not any(believed)


def test_recorded_reports_hide_that_the_robot_is_gone(middle, overheard):
    """An old report is no sign of life."""
    wait(lambda: len(middle.seen["pilot"]) > 5, "reports come")
    recorded, newest = list(middle.seen["pilot"]), overheard.report()[0].seq
    middle.change = lambda to, datagram: None
    number = newest + 100
    end = time.monotonic() + 30.0
    while not overheard.problem and time.monotonic() < end:
        for datagram in recorded:
            number += 1
            with contextlib.suppress(ValueError):  # where reports are JSON, its number is easily changed
                datagram = json.dumps({**json.loads(datagram), "seq": number}).encode()
            middle.send("pilot", datagram)
        time.sleep(0.05)
    assert "does not answer" in overheard.problem


def test_a_stranger_writes_to_the_pilots_terminal(middle, overheard):
    """What proves nothing is not shown, and control characters never are."""
    middle.change = lambda to, datagram: None
    evil = "\x1b[2Jpress reset stop now"
    for fields in ({"type": "refused", "text": evil}, {"type": "done", "id": 1, "ok": True, "text": evil}):
        middle.send("pilot", json.dumps(fields).encode())
    wait(lambda: overheard.problem, "the silence is noticed")
    assert "press reset" not in overheard.problem


def test_a_stranger_answers_a_request_in_the_robots_place(robot, middle, overheard):
    """Nobody but the robot says that it has stopped."""
    middle.change = lambda to, datagram: None
    end = threading.Event()

    def answer() -> None:
        while not end.wait(0.02):
            for number in range(20):
                middle.send("pilot", json.dumps({"type": "done", "id": number, "ok": True, "text": ""}).encode())

    thread = threading.Thread(target=answer)
    thread.start()
    done = overheard.ask("stop", timeout=0.4)
    end.set()
    thread.join()
    assert not done.ok


@pytest.mark.parametrize("keys", ["no key", "another key"])
def test_a_strangers_program_takes_the_robots_place(robot, tmp_path, closing, keys):
    """A pilot who has a robot's key believes nobody who has it not, and learns why there is no driving."""
    option = []
    if keys == "another key":
        RobotKey.make(tmp_path / "robot.key")
        option = ["--key", str(tmp_path / "robot.key")]
    process = start_drive_server(tmp_path / "log", "--robot", robot.simulation.url, *option)
    closing.callback(process.stdout.close)
    closing.callback(processes.end, process, patience=10.0)
    link = closing.enter_context(contextlib.closing(DriveLink(f"{HOST}:{port_of(process)}")))
    end = time.monotonic() + 10.0
    while "./stack pair" not in link.problem and link.report()[0] is None and time.monotonic() < end:
        time.sleep(0.02)
    assert link.report()[0] is None and "./stack pair" in link.problem and keys.split()[-1] in link.problem
