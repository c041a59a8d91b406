"""Targets: what Robotino, its onboard servers, windows and web clients send."""

from __future__ import annotations

import io
import json
import socket
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

from fuzz_harness import Target
from fuzz_values import Values

ADDRESS = ("10.0.0.2", 5000)
NOW = 100.0


def drive_datagram() -> Target:
    """Bodies of both directions, once their seal is checked."""
    from telepresence.drive.datagram import (
        SECTORS,
        BadMessage,
        GoalState,
        Report,
        decode,
        encode,
        encode_report,
        parse_for_robot,
        parse_report,
    )

    goal = GoalState(7, "driving")
    report = Report(1.5, 3, "way is free", "", (0.1, 0.0, 0.0), (0.3,) * SECTORS, 0.5, 2, 0.05, False, goal, 0.5)

    def feed(data: bytes) -> None:
        fields = decode(data)
        if fields["type"] == "report":
            parse_report(fields)
        else:
            parse_for_robot(data)

    seeds = (
        encode(type="drive", seq=3, echo=99.5, after=0.1, velocity=[0.1, 0.0, -0.2], careful=True),
        encode(type="drive", seq=4, echo=99.5, after=0.1, velocity=None, goal={"id": 7, "pose": [1.0, 0.0, 0.5]}),
        encode(type="ask", id=1, what="stop"),
        encode_report(report),
    )
    return Target(feed, seeds, (BadMessage,), 3000)


def drive_session() -> Target:
    """Datagrams at the robot's port: greetings, opens, sealed and forged messages; and at the pilot's."""
    from telepresence.drive.datagram import encode
    from telepresence.drive.pilots import Outgoing, Pilots
    from telepresence.drive.session import KeyMismatch, PilotHandshake
    from telepresence.security.robot_key import RobotKey

    key = RobotKey(bytes(range(32)))
    pilots = Pilots(key)
    pilot = PilotHandshake(key, "ann", 3)
    (challenge,) = pilots.receive(pilot.hello, ADDRESS, NOW)
    assert isinstance(challenge, Outgoing) and pilot.take(challenge.datagram) and pilot.session is not None
    pilots.receive(pilot.open, ADDRESS, NOW)
    sealed = pilot.session.seal(encode(type="ask", id=1, what="leave"))
    strange = PilotHandshake(key, "bea", 0)

    def feed(data: bytes) -> None:
        for answer in pilots.receive(data, ADDRESS, NOW + 0.5):
            size = len(answer.datagram) if isinstance(answer, Outgoing) else 0
            assert size <= max(len(data), 200), "the answer is larger"
        pilots.command(NOW + 0.5)
        strange.take(data)

    return Target(feed, (pilot.hello, challenge.datagram, pilot.open, sealed), (KeyMismatch,), 2000)


def robot_key() -> Target:
    """The text of a key's file, and the address of a robot as somebody types it."""
    from telepresence.security import robot_key

    def feed(data: bytes) -> None:
        text = data.decode("utf-8", "surrogateescape")
        try:
            robot_key.RobotKey.parse(text)
        except ValueError:
            robot_key.path_of(text)

    return Target(feed, (b"0123456789abcdef" * 4 + b"\n", b"10.0.0.2:80", b"http://[fe80::1]:80/"), (ValueError,))


def signed_request() -> Target:
    """Headers by which a request and an answer prove the robot's key."""
    from telepresence.security import signed_requests as signed
    from telepresence.security.robot_key import RobotKey

    key = RobotKey(bytes(range(32)))
    challenges = signed.Challenges()
    asked = signed.Request("POST", "/camera?time=1", "application/sdp", b"v=0")
    header, proof = signed.authorization(key, asked, challenges.new(NOW))
    answer = signed.Answer(201, "/camera/1", "application/sdp", b"v=0")

    def feed(data: bytes) -> None:
        text = data.decode("utf-8", "surrogateescape")  # as aiohttp reads headers
        credentials = signed.credentials_in(text)
        if credentials is not None:
            challenges.fresh(credentials.challenge, NOW)
            if signed.proven(key, asked, credentials):
                challenges.use(credentials.challenge, NOW)
        signed.challenge_in(text)
        signed.answer_proven(key, proof, answer, text)
        signed.proven(key, asked._replace(path=text, content_type=text), signed.credentials_in(header))

    seeds = (header, signed.ask_for_proof(challenges.new(NOW)), signed.answer_proof(key, proof, answer))
    return Target(feed, tuple(seed.encode() for seed in seeds), longest=1200)


def rest_answer() -> Target:
    """Bodies of a Robotino's answers: for every reading, what is not one is refused by name."""
    from rto_node.client import RobotinoClient, RobotinoError

    body = b""

    class Answering(RobotinoClient):
        def _ask(self, *_: object) -> tuple[int, bytes]:
            return 200, body

    client = Answering("127.0.0.1:1")
    readings: tuple[Callable[[], object], ...] = (
        client.odometry,
        client.distances,
        client.bumper,
        client.power,
        client.analog_inputs,
        client.digital_inputs,
        client.relays,
        client.scan,
    )

    def feed(data: bytes) -> None:
        nonlocal body
        body = data
        refused = []
        for read in readings:
            try:
                read()
            except RobotinoError as error:
                assert len(str(error)) < 500, "the error is as long as the robot likes"
                refused.append(error)
        if len(refused) == len(readings):
            raise refused[0]

    names = ("angle_min", "angle_increment", "time_increment", "scan_time", "range_min", "range_max")
    scan = dict.fromkeys(names, 0.1)
    seeds = (
        [0.1, 0.2, 0.3, 0, 0, 0, 17],
        [0.41] * 9,
        {"value": False},
        {"voltage": 24.1, "batteryType": "NiMH", "batteryLow": False, "ext_power": True},
        [True, False] * 4,
        {**scan, "seq": 3, "ranges": [0.5, 1.5, 0.0]},
    )
    return Target(feed, tuple(json.dumps(seed).encode() for seed in seeds), (RobotinoError,), 6000)


def rest_http() -> Target:
    """Bytes of a web server's answer, over a real connection: status line, headers, chunks, lengths."""
    from telepresence.security.bounded_http import BadAnswer, BoundedConnection

    listening = socket.create_server(("127.0.0.1", 0))
    answer = b""

    def serve() -> None:
        while True:
            taken, _ = listening.accept()
            with taken:
                taken.recv(4096)
                try:
                    taken.sendall(answer)
                except OSError:  # it has read enough
                    continue

    threading.Thread(target=serve, daemon=True).start()

    def feed(data: bytes) -> None:
        nonlocal answer
        answer = data
        connection = BoundedConnection("127.0.0.1", listening.getsockname()[1], 5.0)
        try:
            connection.exchange("GET", "/data/odometry", None, {}, time.monotonic() + 5.0, 2000)
        finally:
            connection.close()

    seeds = (
        b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: 7\r\n\r\n[1,2,3]",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n4\r\n[1,2\r\n3\r\n,3]\r\n0\r\n\r\n",
        b"HTTP/1.0 500 No camera connected\r\nConnection: close\r\n\r\n",
        b"HTTP/1.1 302 Found\r\nLocation: http://10.0.0.1/\r\nContent-Length: 0\r\n\r\n",
    )
    return Target(feed, seeds, (BadAnswer, OSError))


def robotino_sim() -> Target:
    """Requests at the simulated Robotino: method, path and body, as its web server hands them over."""
    from robotino_sim.models import robotino_model
    from robotino_sim.robot import Robotino
    from robotino_sim.server import create_app
    from robotino_sim.webcam import Webcam
    from telepresence.sim.scene import build_world

    world = build_world("empty", [robotino_model(laser=False)], 0)  # stands still: nobody steps it
    app = create_app(Robotino(world, None, seed=0), _no_camera(Webcam))

    def feed(data: bytes) -> None:
        head, _, body = data.partition(b"\n")
        method, _, path = head.decode("latin-1").partition(" ")
        status = []
        environ = {
            "REQUEST_METHOD": method,
            "PATH_INFO": path,
            "CONTENT_LENGTH": str(len(body)),
            "wsgi.input": io.BytesIO(body),
        }
        b"".join(app(environ, lambda line, _headers: status.append(line)))
        assert status and not status[0].startswith("500"), status

    seeds = (
        b"PUT /data/omnidrive\n[0.1, 0, -0.2]",
        b'POST /data/digitaloutput\n{"num": 3, "val": true}',
        b"PUT /data/relayarray\n[true, false]",
        b'PUT /data/poweroutput\n{"value": 50}',
        b'POST /data/uploadProgram\n{"name": "a.rvw2", "data": "cm9ib3Q="}',
        b'POST /data/renameprogram\n{"from": "a", "to": "b"}',
        b"GET /data/odometry\n",
        b"GET /data/servicestatus/x\n",
        b"GET /download/program/a.rvw2\n",
        b"OPTIONS /\n",
    )
    return Target(feed, seeds, longest=5000)


def _no_camera(webcam: type) -> object:
    class Dark(webcam):  # type: ignore[misc, valid-type]
        def __init__(self) -> None:
            """Renders nothing."""

        awake = False

        def wake(self) -> None:
            """There is nothing to be woken."""

        def jpeg(self) -> tuple[bytes, int]:
            return b"", 1

    return Dark()


def page_request() -> Target:
    """Requests at a page with a key: names, origins, cookies, queries, paths."""
    from telepresence.web.page_auth import PageAuth, ProtectedPage

    auth = PageAuth("secret-token", ("robot",))

    def page(_environ: object, start_response: Callable) -> list[bytes]:
        start_response("200 OK", [])
        return [b"seen"]

    app = ProtectedPage(page, auth, "default-src 'none'")
    names = ("HTTP_HOST", "HTTP_ORIGIN", "HTTP_COOKIE", "HTTP_SEC_FETCH_SITE", "HTTP_SEC_FETCH_MODE")

    def feed(data: bytes) -> None:
        method, path, query, *headers = (*data.decode("latin-1").split("\n"), "", "", "")[:8]
        environ = {"REQUEST_METHOD": method, "PATH_INFO": path, "QUERY_STRING": query, "REMOTE_ADDR": "10.0.0.9"}
        environ |= {name: value for name, value in zip(names, headers, strict=False) if value}
        shown = b"".join(app(environ, lambda *_: None))
        assert b"seen" not in shown or auth.session in environ.get("HTTP_COOKIE", ""), "seen without the key"

    seeds = (
        f"GET\n/{auth.place}/\n\n10.0.0.1:10002\n\ntp={auth.session}",
        "GET\n/\nk=secret-token\nlocalhost\n\n\nnone\nnavigate",
        "GET\n/\nk=wrong&adv=1\nrobot:10002\nhttp://evil.example",
    )
    return Target(feed, tuple(seed.encode() for seed in seeds), longest=2000)


def lease_message() -> Target:
    """What windows send to drive_lease, known or not, in every field that a ROS message has."""
    from telepresence.security.signing import Received
    from telepresence.teleop.drive_lease import DriveLease
    from telepresence.teleop.key_agreement import Claim
    from telepresence.teleop.lease_messages import PILOT, Account, Reply, SignedCommand, sign_command, sign_request

    account = Account("ann", PILOT, 1)
    lease = DriveLease({"ann": account}.get)
    key = bytes(32)

    def joined() -> None:
        from telepresence.teleop.lease_windows import Window

        lease.admit(Window("session", account, "/window", key, Received(key), NOW), NOW)

    joined()

    def feed(data: bytes) -> None:
        values = Values(data)
        kind, genuine = values.byte() % 4, values.byte() % 2
        session = "session" if values.byte() < 200 else values.text()
        if kind == 0:
            claim = Claim(values.text(), values.text(), values.take(values.byte() % 40))
            offer = lease.offer(claim, NOW)
            found = lease.prove(claim, offer.session if genuine else session, values.take(16), NOW)
            assert isinstance(found, Reply) and not found.ok, "joined without the password"
        elif kind == 1:
            velocity = (values.number(), values.number(), values.number()) if values.byte() < 128 else None
            command = SignedCommand(values.whole(), values.number(), velocity, values.text(), values.take(16))
            if genuine and 0 <= command.number < 2**63:
                command = SignedCommand(*_fields(command), sign_command(key, command))
            lease.receive(session, command, NOW)
        elif kind == 2:
            number, action, to = values.whole(), values.text(), values.text()
            action = action or ("take", "give", "stop", "reset_stop", "keep", "release")[values.byte() % 6]
            proof = values.take(values.byte() % 20)
            if genuine and 0 <= number < 2**63:
                proof = sign_request(key, number, action, to)
            lease.sign(session, number % 2**63, lease.ask(session, number, action, to, proof, NOW))
        else:
            lease.receive_other(values.text(), (values.number(), values.number(), values.number()), NOW)
        lease.tick(NOW)
        lease.state(NOW)
        if not lease.sessions():
            joined()

    texts = b"\3ann\x07/window" + bytes(60)
    return Target(
        feed, (b"\0\1\0" + texts, b"\1\1\0\0" + bytes(80), b"\2\1\0" + bytes(60), b"\3\0\0" + texts), longest=600
    )


def _fields(command: object) -> tuple:
    return tuple(getattr(command, name) for name in ("number", "sent", "velocity", "hold"))


def account_name() -> Target:
    """Names that somebody types or sends: sought in the accounts' database, and removed from it."""
    from telepresence.teleop.accounts import PILOT, UserError, Users
    from telepresence.teleop.password_key import Cost

    folder = tempfile.TemporaryDirectory()
    users = Users(Path(folder.name) / "users.db", Cost(1, 8, 1))
    users.add("ann", "a long password", PILOT)

    def feed(data: bytes, _folder: object = folder) -> None:
        name = data.decode("utf-8", "surrogateescape")
        found = users.find(name)
        assert found is None or found.name == name
        if name.strip() == "ann" or data[-1:] > b"\xf0":  # seldom: hashing a password takes milliseconds
            try:
                users.check(name, "a wrong password", 0.0, lambda _: None)
            except UserError:
                return
        users.remove(name)

    return Target(feed, (b"ann", b"ann ", b" ann"), (UserError,), 300)
