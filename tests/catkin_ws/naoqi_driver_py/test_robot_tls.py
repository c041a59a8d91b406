"""A station's drive server, far from a robot that speaks TLS: libqi's own server behind a TLS socket, our own one with
a password, and those who do not behave."""

from __future__ import annotations

import contextlib
import os
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import qi
from naoqi_driver.certificate_pin import CertificatePin, CertificateRefused, path_of
from naoqi_driver.connection import Address
from naoqi_driver.onboard.pepper_base import FAR_SPEED
from naoqi_driver.own_drive_server import OwnDriveServer
from naoqi_driver.robot_tls import RobotTls
from onboard_pepper import drive
from tcp_listener import TcpListener
from tls_front import TlsFront, make_certificate

from telepresence.drive.link import DriveLink
from telepresence.naoqi.codec import decode, encode
from telepresence.naoqi.dynamics import Typed
from telepresence.naoqi.login import ServerLogin
from telepresence.naoqi.releases import RELEASES
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.server import Server
from telepresence.robot_side.naoqi_client import Client
from telepresence.robot_side.naoqi_connection import POST, Wire
from telepresence.robot_side.naoqi_values import NaoqiError
from telepresence.station import processes

SECRET = "correct horse"


@pytest.fixture(scope="module")
def certificates(tmp_path_factory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("certificates")
    return make_certificate(folder, "pepper"), make_certificate(folder, "mallory")


@pytest.fixture(autouse=True)
def pins(tmp_path_factory, monkeypatch) -> None:
    """A path of ordinary length, so that reports have room for it."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("pins")))


@pytest.fixture
def front(naoqi, motion, certificates) -> Iterator[TlsFront]:
    made = TlsFront(naoqi.port, certificates[0])
    yield made
    made.close()


@pytest.fixture
def start_station() -> Iterator[Callable[..., tuple[OwnDriveServer, DriveLink]]]:
    """Starts what a driver starts: a drive server, and a pilot of it."""
    with contextlib.ExitStack() as opened:

        def start(port: int, password: str = SECRET) -> tuple[OwnDriveServer, DriveLink]:
            server = OwnDriveServer(Address.parse("tcps://127.0.0.1", port, "nao", password), lambda: None)
            opened.callback(server.close)
            pilot = DriveLink(server.address)
            opened.callback(pilot.close)
            return server, pilot

        yield start


@pytest.fixture
def robot(certificates) -> Iterator[Server]:
    """NAOqi 2.9 that knows one user; ALMotion moves nothing."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificates[0])
    made = Server("tcps://127.0.0.1:0", release=RELEASES["2.9"], login={"nao": SECRET}, tls=context)
    motion = ServedObject()
    for name in ("stopMove", "killMove"):
        motion.add_method(name, "v", "()", lambda: None)
    motion.add_method("moveIsActive", "b", "()", lambda: False)
    motion.add_method("echo", "m", "(m)", lambda value: value)
    made.register("ALMotion", motion)
    made.start()
    yield made
    made.close()


@pytest.fixture
def connect() -> Iterator[Callable[..., Client]]:
    made: list[Client] = []

    def dial(port: int, password: str | None = SECRET, scheme: str = "tcps") -> Client:
        tls = RobotTls(CertificatePin("127.0.0.1", port), "nao" if password else None, password)
        made.append(Client(f"{scheme}://127.0.0.1:{port}", tls=tls))
        return made[-1]

    yield dial
    for each in made:
        each.close()
    assert not any(thread.name == "naoqi-reader" for thread in threading.enumerate()), "its threads end with it"


def port_of(robot: Server) -> int:
    return int(robot.endpoints[0].rpartition(":")[2])


def reason(pilot: DriveLink) -> str:
    report = pilot.report()[0]
    return report.reason if report else ""


def state(pilot: DriveLink) -> str:
    report = pilot.report()[0]
    return report.state if report else ""


def test_a_drive_server_drives_and_stops_a_robot_through_tls(front, motion, start_station, wait_until):
    server, pilot = start_station(front.port)
    wait_until(lambda: state(pilot) == "no command", "the server has found NAOqi")
    drive(pilot, motion, wait_until, "moveTo")
    x, y, theta, duration, limits = [call for call in motion.calls if call[0] == "moveTo"][-1][1:]
    assert 0.0 < x < 0.1 and y == 0.0 and 0.0 < theta < 0.05 and 0.0 < duration < 1.0
    assert dict(limits)["MaxVelXY"] == pytest.approx(FAR_SPEED)
    pilot.release(hard=True)
    wait_until(lambda: motion.names()[-1] == "killMove", "it is let go of")
    assert "move" not in motion.names(), "a motion without an end of its own"
    assert front.connections == 1, "one connection leads to all services of the robot"
    assert SECRET.encode() in front.received
    for pid in [server._process.pid, *processes.descendants(server._process.pid)]:
        assert SECRET.encode() not in Path(f"/proc/{pid}/cmdline").read_bytes()


def test_a_network_that_holds_all_back_delivers_one_motion_at_most_and_the_robot_is_stopped(
    front, motion, make_connection, start_station, wait_until
):
    """What a cut network holds back does not arrive at all: see `onboard/test_far_cut.py`."""
    wire = make_connection(front.port)
    _, pilot = start_station(wire.port)
    wait_until(lambda: state(pilot) == "no command", "the server has found NAOqi")
    drive(pilot, motion, wait_until, "moveTo")
    wire.freeze()

    def told() -> bool:
        pilot.drive(0.2, 0.0, 0.1)
        return "not reachable" in reason(pilot)

    wait_until(told, "the pilot, who goes on driving, is told")
    pilot.release()
    wait_until(lambda: pilot.report()[0].state == "fault" and pilot.report()[0].given == (0.0, 0.0, 0.0), "let go of")
    motion.calls.clear()
    wire.thaw()
    wait_until(lambda: state(pilot) == "no command", "it is reached again")
    wait_until(lambda: motion.names()[-1:] == ["killMove"], "what it was left with does not go on")
    assert [call[0] for call in motion.calls].count("moveTo") <= 1


def test_the_pilot_is_told_the_remedy_when_another_certificate_is_shown(front, certificates, start_station, wait_until):
    _, pilot = start_station(front.port)
    wait_until(lambda: state(pilot) == "no command", "the server has found NAOqi")
    front.received = b""
    front.show(certificates[1])
    path = path_of("127.0.0.1", front.port)
    wait_until(lambda: reason(pilot).endswith(f"rm {path}."), "the change is told")
    assert state(pilot) == "fault"
    assert SECRET.encode() not in front.received, "somebody else got the password"
    path.unlink()
    wait_until(lambda: state(pilot) == "no command", "accepted by hand")


def test_the_pilot_is_told_that_the_password_is_wrong(robot, start_station, wait_until):
    _, pilot = start_station(port_of(robot), "wrong")
    wait_until(lambda: "wrong user or password" in reason(pilot), "it is refused")
    assert "NAO_USER and NAO_PASSWORD" in reason(pilot) and state(pilot) == "fault"
    _, right = start_station(port_of(robot))
    wait_until(lambda: state(right) == "no command", "the right one is accepted")


def test_a_login_without_a_password_is_refused_in_words(robot, connect):
    with pytest.raises(NaoqiError, match=r"NAO_USER and NAO_PASSWORD are not set.*wrong user or password"):
        connect(port_of(robot), None)


def test_a_robot_that_asks_again_is_told_the_same_again(robot, connect, monkeypatch):
    said: list[dict] = []

    def authenticate(self: ServerLogin, header: object, payload: bytes) -> None:
        said.append(decode("{sm}", payload))
        done = len(said) == 2
        self._connection.reply(header, encode("{sm}", {"__qi_auth_state": Typed("I", 3 if done else 2)}))
        if done:
            self._admit()

    monkeypatch.setattr(ServerLogin, "_authenticate", authenticate)
    assert connect(port_of(robot)).service("ALMotion").ask("moveIsActive") is False
    assert said[1] == {"auth_user": "nao", "auth_token": SECRET} and said[0].items() > said[1].items()


def test_a_robot_that_asks_for_ever_is_left(robot, connect, monkeypatch):
    monkeypatch.setattr(
        ServerLogin,
        "_authenticate",
        lambda self, header, _: self._connection.reply(header, encode("{sm}", {"__qi_auth_state": Typed("I", 2)})),
    )
    with pytest.raises(NaoqiError, match="does not stop asking"):
        connect(port_of(robot))


def test_over_tcp_nobody_gets_the_password(front, connect):
    front.show(None)
    assert connect(front.port, scheme="tcp").service("ALMotion").ask("moveIsActive") is False
    assert front.received and SECRET.encode() not in front.received


def test_who_speaks_no_tls_gets_no_password(front, connect):
    front.show(None)
    with pytest.raises(NaoqiError, match="TLS"):
        connect(front.port)
    assert SECRET.encode() not in front.received


@pytest.mark.parametrize("end", ["closes", "says nothing"])
def test_a_handshake_that_does_not_come_ends(end, connect):
    answered = threading.Event()
    listener = TcpListener(lambda near: near.close() if end == "closes" else answered.wait(10))
    try:
        with pytest.raises((NaoqiError, ConnectionResetError)):
            connect(listener.port)
    finally:
        answered.set()
        listener.close()


@pytest.mark.parametrize("kind", ["the robot's", "another certificate", "tcp"])
def test_an_address_that_the_directory_names_gets_nothing_unless_it_is_the_robots(
    front, certificates, naoqi, connect, kind
):
    """A second connection is checked like the first, and what began encrypted does not go on in the clear."""
    shown = {"the robot's": certificates[0], "another certificate": certificates[1], "tcp": None}[kind]
    other = TlsFront(naoqi.port, shown)
    directory = qi.Session()
    directory.connect(f"tcp://127.0.0.1:{naoqi.port}")
    service = directory.service("ServiceDirectory")
    number = next(each["serviceId"] for each in naoqi.session.services() if each["name"] == "ALMotion")
    place = [f"{'tcps' if shown else 'tcp'}://127.0.0.1:{other.port}"]
    service.serviceReady(service.registerService(("ALTablet", 0, "another", os.getpid(), place, "session", "")))
    assert number
    client = connect(front.port)
    try:
        if kind == "the robot's":
            with contextlib.suppress(NaoqiError):  # the number is that of another program, which is not there
                client.service("ALTablet")
            assert SECRET.encode() in other.received and len(client.wires) == 2
        else:
            with pytest.raises((NaoqiError, CertificateRefused), match="certificate" if shown else "no way in by tcps"):
                client.service("ALTablet")
            assert not other.received
        assert client.connected()
    finally:
        other.close()
        directory.close()


def test_threads_that_send_while_answers_arrive_do_not_disturb_each_other(robot, connect):
    motion = connect(port_of(robot)).service("ALMotion")
    wrong: list[object] = []

    def ask(thread: int) -> None:
        for count in range(100):
            values = [[thread, count, each, "x" * 15000] for each in range(4)]
            answers = [motion.send("echo", value) for value in values]
            if [answer.value(20.0) for answer in answers] != values:
                wrong.append(values)

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert not wrong and not motion.wire.problem and not any(thread.is_alive() for thread in threads)
    assert motion.send("echo", "y" * 2_000_000).value(20.0) == "y" * 2_000_000


def test_what_is_not_taken_at_once_ends_the_connection_and_is_lost(certificates):
    """A robot that reads nothing: sending does not wait, and what waits in the connection never arrives."""
    received, ended = [], []
    aborted, known = threading.Event(), threading.Event()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificates[0])

    def talk(near: socket.socket) -> None:
        near.settimeout(20.0)
        with context.wrap_socket(near, server_side=True) as end:
            head = end.recv(28)
            end.recv(65536)
            payload = b"".join(encode("{sm}", {"__qi_auth_state": Typed("I", 3)}))
            end.sendall(head[:8] + len(payload).to_bytes(4, "little") + b"\0\0\2\0" + head[16:] + payload)
            aborted.wait(20.0)
            try:
                while data := socket.socket.recv(end, 65536):  # as it came, encrypted
                    received.append(len(data))
                ended.append("closed")
            except OSError as error:
                ended.append(type(error).__name__)
            known.set()

    listener = TcpListener(talk)
    try:
        place = ("127.0.0.1", listener.port)
        wire, sent = Wire(place, 5.0, RobotTls(CertificatePin(*place), "nao", SECRET)), 0
        wire.call(1, 1, bytes(1000), "v", "small", POST)
        with pytest.raises(NaoqiError, match="takes nothing more"):
            for _ in range(1000):
                wire.call(1, 1, bytes(65536), "v", "large", POST)
                sent += 65536
        assert wire.problem == "it takes nothing more" and sent > 0
        aborted.set()
        assert known.wait(20.0)
        assert ended == ["ConnectionResetError"] and sum(received) < sent
    finally:
        aborted.set()
        listener.close()
