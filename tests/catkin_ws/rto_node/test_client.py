"""The client against the simulated robot, and against servers that do not behave."""

import contextlib
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from machines import Machine
from rto_node.client import (
    LONGEST_BACK_OFF,
    RequestRefused,
    RobotinoClient,
    RobotinoUnreachable,
    parse_address,
)

from robotino_sim.simulation import Simulation

DEADLINE = 30.0


@pytest.fixture(scope="module")
def simulation():
    with Simulation(scene="empty", port=0, laser=True) as running:
        yield running


@pytest.fixture
def client(simulation):
    simulation.restart()
    client = RobotinoClient(simulation.url, timeout=5.0)
    yield client
    client.close()


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


class BadServer:
    """Answers every request with the bytes given, or with silence; counts connections."""

    def __init__(self, answer, close=False):
        self.answer, self.connections = answer, 0
        self._close = close
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        while True:
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            self.connections += 1
            threading.Thread(target=self._talk, args=(near,), daemon=True).start()

    def _talk(self, near):
        with near, contextlib.suppress(OSError):  # a client that hangs up
            while near.recv(65536):
                if self.answer is not None:
                    near.sendall(self.answer)
                if self._close:
                    return

    def close(self):
        self._listener.close()


@pytest.fixture
def bad_server():
    servers = []

    def make(answer, close=False):
        servers.append(BadServer(answer, close))
        return servers[-1]

    yield make
    for server in servers:
        server.close()


def address_of(listener):
    return f"127.0.0.1:{listener.getsockname()[1]}"


def http_answer(body, status="200 OK"):
    return f"HTTP/1.1 {status}\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body


# --- a robot that behaves --------------------------------------------------------------------------------------------


def test_reads_everything(client, simulation, wait_until):
    assert client.odometry()[:6] == (0.0,) * 6
    assert len(client.distances()) == 9 and client.bumper() is False
    assert client.analog_inputs() == (0.0,) * 8
    assert client.digital_inputs() == client.digital_outputs() == (False,) * 8
    assert client.relays() == (False, False)
    power = client.power()
    assert 15.0 < power.voltage < 30.0 and power.kind == "NiMH" and not power.low
    scan = wait_until(client.scan, "a scan")
    assert len(scan.ranges) == 441 and scan.range_max == 20.0
    assert client.picture().startswith(b"\xff\xd8")


def test_drives_and_sets_outputs(client, simulation, wait_until):
    wait_until(lambda: client.drive(0.2, 0.0, 0.0) or client.odometry().x > 0.02, "the robot drives")
    client.set_digital_outputs([True] * 8)
    client.set_relays([False, True])
    client.set_power_output(10)
    assert client.digital_outputs() == (True,) * 8 and client.relays() == (False, True)


def test_no_laser_is_none():
    with Simulation(scene="empty", port=0) as simulation:
        assert RobotinoClient(simulation.url).scan() is None


def test_keeps_one_connection_open(bad_server):
    server = bad_server(http_answer(b'{"value":false}'))
    client = RobotinoClient(server.address)
    for _ in range(5):
        assert client.bumper() is False
    assert server.connections == 1


def test_opens_a_new_connection_when_the_robot_closed_the_old_one(bad_server):
    server = bad_server(http_answer(b'{"value":true}'), close=True)
    client = RobotinoClient(server.address)
    for count in range(1, 5):
        assert client.bumper() is True
        assert server.connections == count


@pytest.mark.parametrize("velocity", [(float("nan"), 0, 0), (0, float("inf"), 0)])
def test_never_sends_what_is_not_a_number(client, velocity):
    with pytest.raises(ValueError, match="finite"):
        client.drive(*velocity)


# --- robots that do not ----------------------------------------------------------------------------------------------


def test_silence_is_an_error_with_address_and_cause(bad_server):
    server = bad_server(None)
    client = RobotinoClient(server.address, timeout=0.1)
    with pytest.raises(RobotinoUnreachable, match=rf"{server.address} .*nothing within 0.1 s"):
        client.odometry()


def test_a_late_answer_is_not_taken_for_the_next_one(bad_server):
    """After a timeout the connection is given up: its answer may still come."""
    server = bad_server(None)
    clock = Clock()
    client = RobotinoClient(server.address, timeout=0.1, clock=clock)
    with pytest.raises(RobotinoUnreachable):
        client.bumper()
    server.answer = http_answer(b'{"value":true}')
    clock.now += 10.0
    assert client.bumper() is True
    assert server.connections == 2


def test_a_velocity_that_a_cut_network_has_held_up_is_never_delivered():
    machine = Machine()
    try:
        with machine.entered(), socket.create_server(("127.0.0.1", 0)) as listener:
            client = RobotinoClient(address_of(listener), timeout=0.2)
            with ThreadPoolExecutor() as others:
                first = others.submit(client.drive, 0.2, 0.0, 0.0)
                near, _ = listener.accept()
                while not near.recv(65536).endswith(b"[0.2, 0.0, 0.0]"):
                    pass
                near.sendall(http_answer(b""))
                first.result()
            machine.run("ip", "link", "set", "lo", "down")
            with pytest.raises(RobotinoUnreachable):
                client.drive(0.2, 0.0, 0.0)
            machine.run("ip", "link", "set", "lo", "up")
            near.settimeout(2.0)  # the kernel sends again after 0.2, 0.6 and 1.4 s
            with near, pytest.raises(TimeoutError):
                near.recv(65536)
    finally:
        machine.close()


def test_backs_off_after_failures_and_comes_back(free_port, bad_server):
    clock = Clock()
    client = RobotinoClient(f"127.0.0.1:{free_port()}", timeout=0.5, clock=clock)
    waits = []
    for _ in range(6):
        with pytest.raises(RobotinoUnreachable, match="connection refused"):
            client.odometry()
        begin = clock.now
        while True:
            clock.now += 0.01
            started = time.monotonic()
            with pytest.raises(RobotinoUnreachable, match="connection refused"):
                client.odometry()
            assert time.monotonic() - started < 5.0
            if client._not_before > clock.now:
                if client._not_before - clock.now > 0.99 * client._back_off:
                    break  # a real attempt was made
        waits.append(clock.now - begin)
    assert waits == sorted(waits)
    assert waits[0] < 0.3 and waits[-1] == pytest.approx(LONGEST_BACK_OFF, abs=0.03)


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"[1,2,3]",
        b"hello",
        b'{"x":1}',
        b"[0,0,0,0,0,0,null]",
        b'[0,0,0,0,0,0,"7"]',
        b"[0,0,NaN,0,0,0,1]",
        b"[0,0,-Infinity,0,0,0,1]",
        b"[0,0,1e400,0,0,0,1]",
        b"[0,0,1e300,0,0,0,1]",
        b"[0,0," + b"9" * 400 + b",0,0,0,1]",
        b"[0,0," + b"9" * 5000 + b",0,0,0,1]",
        b"[0,0,[[[[\x1b[2J]]]],0,0,0,1]",
        b"[" * 100_000 + b"]" * 100_000,
        b'{"a":' * 50_000,
        b'["\\ud800",0,0,0,0,0,1]',
        b"[true,0,0,0,0,0,1]",
        b"\xff",
    ],
    ids=lambda body: body[:20],
)
def test_nonsense_is_refused(bad_server, body):
    client = RobotinoClient(bad_server(http_answer(body)).address)
    with pytest.raises(RequestRefused) as refusal:
        client.odometry()
    assert len(str(refusal.value)) < 250 and str(refusal.value).isprintable()


@pytest.mark.parametrize(
    "body",
    [
        b'{"value":false,"value":true}',
        b'{"value":"false"}',
        b'{"value":2}',
        b'{"value":0.0}',
        b'{"value":null}',
        b"[false]",
    ],
)
def test_a_bumper_is_neither_pressed_nor_free_by_an_ambiguous_answer(bad_server, body):
    with pytest.raises(RequestRefused):
        RobotinoClient(bad_server(http_answer(body)).address).bumper()


def test_odometry_may_have_values_that_nobody_knows(bad_server):
    client = RobotinoClient(bad_server(http_answer(b"[1,2,0.5,0.1,0,0,27501,null]")).address)
    assert client.odometry() == (1.0, 2.0, 0.5, 0.1, 0.0, 0.0, 27501)


@pytest.mark.parametrize(("value", "pressed"), [("0", False), ("1", True), ("false", False), ("true", True)])
def test_a_bumper_is_a_truth_or_a_bit(bad_server, value, pressed):
    client = RobotinoClient(bad_server(http_answer(f'{{"value":{value}}}'.encode())).address)
    assert client.bumper() is pressed


@pytest.mark.parametrize(
    "scan", [b"7", b"[]", b'{"ranges":[1]}', b'{"ranges":[' + b"0," * 20_000 + b"0]}", b'{"ranges":7,"seq":1}']
)
def test_what_is_no_scan_is_refused(bad_server, scan):
    with pytest.raises(RequestRefused):
        RobotinoClient(bad_server(http_answer(scan)).address).scan()


@pytest.mark.parametrize(
    "answer",
    [
        b"HTTP/1.1 99999999999999999999999999 OK\r\n\r\n",
        b"HTTP/1.1 \xff\xfe\r\n\r\n",
        b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 5000 + b"\r\n",
        b"HTTP/1.1 200 OK\r\nX: " + b"y" * 300_000,
        b"HTTP/1.1 100 Continue\r\n\r\n" * 20_000,
        b"HTTP/1.1 200 OK\r\nContent-Length: 999999999\r\n\r\n" + b" " * 1_000_000,
        b"HTTP/1.1 200 OK\r\n\r\n" + b" " * 1_000_000,
        b"HTTP/1.1 200 OK\r\nContent-Length: " + b"9" * 5000 + b"\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n-5\r\n[]\r\n0\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n-1\r\n" + b" " * 1_000_000,
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n" + b"X: y\r\n" * 100_000,
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: 4\r\n\r\n\x1f\x8b\x08\x00",
    ],
    ids=lambda answer: answer[:60],
)
def test_what_is_no_http_counts_as_no_answer(bad_server, answer):
    """Whatever it is, it costs no more than the time-out and no more memory than the largest answer."""
    client = RobotinoClient(bad_server(answer).address, timeout=0.5)
    with pytest.raises(RobotinoUnreachable) as failure:
        client.bumper()
    assert len(str(failure.value)) < 250 and str(failure.value).isprintable()


def test_an_answer_byte_by_byte_is_given_up_in_time(bad_server, wait_until):
    """The time-out is for the whole answer, not for each piece."""
    stop = threading.Event()
    listener = socket.create_server(("127.0.0.1", 0))

    def drip():
        near, _ = listener.accept()
        with near:
            near.sendall(b"HTTP/1.1 200 OK\r\nX: ")
            while not stop.wait(0.02):
                with contextlib.suppress(OSError):
                    near.sendall(b"y")

    thread = threading.Thread(target=drip)
    thread.start()
    asked = threading.Thread(
        target=pytest.raises, args=(RobotinoUnreachable, RobotinoClient(address_of(listener), timeout=0.2).bumper)
    )
    asked.start()
    wait_until(lambda: not asked.is_alive(), "the client gives up")
    stop.set()
    thread.join()
    listener.close()


class NameServer:
    """Stands in for the system's look-up of one name, which waits until it `answers`."""

    def __init__(self, monkeypatch):
        self.answers, self.asked = threading.Event(), 0
        self._really = socket.getaddrinfo
        monkeypatch.setattr(socket, "getaddrinfo", self.look_up)

    def look_up(self, host, port, *rest, flags=0, **more):
        if host == "robotino.test" and not flags & socket.AI_NUMERICHOST:
            self.asked += 1
            self.answers.wait(DEADLINE)
            host = "127.0.0.1"
        return self._really(host, port, *rest, flags=flags, **more)


@pytest.fixture
def name_server(monkeypatch):
    made = NameServer(monkeypatch)
    yield made
    made.answers.set()


def named(server):
    return f"robotino.test:{server.address.rpartition(':')[2]}"


def test_a_name_server_that_does_not_answer_takes_no_longer_than_a_question_may(bad_server, name_server, wait_until):
    client = RobotinoClient(named(bad_server(http_answer(b'{"value":true}'))), timeout=0.2)
    for _ in range(2):
        with pytest.raises(RobotinoUnreachable, match=r"nothing within 0.2 s"):
            client.bumper()
    assert name_server.asked == 1, "the first look-up still runs"
    name_server.answers.set()
    assert wait_until(lambda: answered(client), "the name is known") is True


def test_a_name_that_was_found_once_is_not_looked_up_for_every_connection(bad_server, name_server):
    name_server.answers.set()
    server = bad_server(http_answer(b'{"value":true}'), close=True)
    client = RobotinoClient(named(server), timeout=5.0)
    assert [client.bumper() for _ in range(3)] == [True] * 3
    assert server.connections == 3 and name_server.asked == 1


def answered(client):
    with contextlib.suppress(RobotinoUnreachable):
        return client.bumper()


def test_a_redirect_leads_nowhere(bad_server):
    other = bad_server(http_answer(b'{"value":true}'))
    moved = f"HTTP/1.1 302 Found\r\nLocation: http://{other.address}/\r\nContent-Length: 0\r\n\r\n".encode()
    with pytest.raises(RequestRefused, match="302"):
        RobotinoClient(bad_server(moved).address).bumper()
    assert other.connections == 0


def test_refusals_carry_the_robots_reason(bad_server):
    client = RobotinoClient(bad_server(http_answer(b"not today", "400 Bad Request")).address)
    with pytest.raises(RequestRefused, match="400: not today"):
        client.drive(0.1, 0.0, 0.0)


def test_not_http_at_all(bad_server):
    client = RobotinoClient(bad_server(b"SSH-2.0-OpenSSH\r\n", close=True).address)
    with pytest.raises(RobotinoUnreachable):
        client.bumper()


def test_a_camera_that_wakes_up_has_no_picture_yet(bad_server):
    body = http_answer(b"No camera connected", "500 Internal Server Error")
    assert RobotinoClient(bad_server(body).address).picture() is None


def test_millivolts_become_volts(bad_server):
    assert RobotinoClient(bad_server(http_answer(b'{"voltage":19800}')).address).power().voltage == 19.8


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("192.168.0.1", ("192.168.0.1", 80)),
        ("robotino:8080", ("robotino", 8080)),
        ("http://10.0.0.7/", ("10.0.0.7", 80)),
        ("http://10.0.0.7:81", ("10.0.0.7", 81)),
    ],
)
def test_addresses(text, found):
    assert parse_address(text) == found


@pytest.mark.parametrize(
    "text",
    [
        "",
        "tcp://10.0.0.7",
        "a b",
        "host:port",
        "host:0",
        "host:70000",
        "http://",
        "192.168..1",
    ],
)
def test_wrong_addresses_are_explained(text):
    with pytest.raises(ValueError):
        parse_address(text)
