"""MJPEG over real sockets, read by a client of its own that knows HTTP chunks and multipart."""

from __future__ import annotations

import errno
import http.client
import resource
import select
import socket
import threading
from collections.abc import Iterator

import pytest
from flask import Flask, Response, request
from waiting import wait_until

from telepresence.video.images import LatestImage
from telepresence.video.mjpeg import CONTENT_TYPE, MjpegStream, TooManyViewers
from telepresence.web.listener import listener
from telepresence.web.server import WebServer

SIZE = 57_000  # bytes of a 640x480 picture at quality 80


def picture(number: int) -> bytes:
    return b"%08d" % number + bytes(SIZE - 8)


class Viewer:
    """Reads one stream; `number()` is the number painted on the next picture."""

    def __init__(self, server: WebServer, path: str = "/stream", receive_buffer: int | None = None) -> None:
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(30)
        self.socket.connect((server.address, server.port))
        self.socket.sendall(b"GET %s HTTP/1.1\r\nHost: %s\r\n\r\n" % (path.encode(), server.address.encode()))
        self._file = self.socket.makefile("rb")
        self.status = int(self._file.readline().split()[1])
        self.headers = {}
        while line := self._file.readline().strip():
            name, _, value = line.decode().partition(": ")
            self.headers[name.lower()] = value
        self._body = bytearray()
        if self.status == 200:
            self._skip_past(b"--frame\r\n")

    def _more(self) -> None:
        assert self.headers["transfer-encoding"] == "chunked"
        size = int(self._file.readline(), 16)
        if size == 0:
            raise EOFError
        self._body += self._file.read(size)
        assert self._file.readline() == b"\r\n"

    def _skip_past(self, mark: bytes) -> bytes:
        while mark not in self._body:
            self._more()
        before, _, self._body = self._body.partition(mark)
        return bytes(before)

    def part(self) -> tuple[dict[str, str], bytes]:
        lines = self._skip_past(b"\r\n\r\n").decode().split("\r\n")
        headers = dict(line.split(": ", 1) for line in lines)
        if "Content-Length" not in headers:
            return headers, self._skip_past(b"\r\n--frame\r\n")
        size = int(headers["Content-Length"])
        while len(self._body) < size:
            self._more()
        body = bytes(self._body[:size])
        del self._body[:size]
        self._skip_past(b"\r\n--frame\r\n")
        return headers, body

    def number(self) -> int:
        return int(self.part()[1][:8])

    def close(self) -> None:
        self._file.close()
        self.socket.close()


class Studio:
    """A stream on a free port."""

    def __init__(self, *, timeout: float = 10.0, **options: float) -> None:
        self.image = LatestImage()
        self.stream = MjpegStream(self.image, **options)
        app = Flask(__name__)

        @app.get("/stream")
        def stream() -> Response:
            try:
                viewing = self.stream.view(
                    advance="adv" in request.args,
                    address=request.args.get("address", ""),
                    name=request.args.get("name", ""),
                )
            except TooManyViewers as error:
                return Response(str(error), 503)
            return Response(viewing, content_type=CONTENT_TYPE)

        @app.get("/next")
        def next_picture() -> Response:
            newer = self.stream.newer(int(request.args["after"]), float(request.args["timeout"]))
            return (
                Response(newer.content, headers={"X-Sequence": str(newer.sequence)}) if newer else Response(status=204)
            )

        self.server = WebServer(app, timeout=timeout)

    def put(self, number: int) -> None:
        self.image.put(picture(number))

    def __enter__(self) -> Studio:
        self.server.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.server.close()


@pytest.fixture
def studio() -> Iterator[Studio]:
    with Studio(max_viewers=100, max_viewers_per_address=100) as studio:
        yield studio


def test_every_viewer_sees_every_picture_when_all_keep_up(studio: Studio) -> None:
    studio.put(1)
    viewers = [Viewer(studio.server) for _ in range(32)]
    assert [viewer.number() for viewer in viewers] == [1] * 32
    for number in range(2, 12):
        studio.put(number)
        assert [viewer.number() for viewer in viewers] == [number] * 32
    assert studio.stream.viewers == 32


def test_plain_layout_states_length_and_time(studio: Studio) -> None:
    studio.image.put(picture(5), stamp=1234.5)
    headers, body = Viewer(studio.server).part()
    assert headers == {"Content-Type": "image/jpeg", "Content-Length": str(SIZE), "X-Timestamp": "1234.500000"}
    assert body == picture(5)


def test_advance_layout_sends_the_next_parts_headers_with_the_picture() -> None:
    with Studio(resend_period=60) as studio:
        studio.put(1)
        viewer = Viewer(studio.server, "/stream?adv=1")
        assert viewer.part() == ({"Content-Type": "image/jpeg"}, picture(1))
        # Nothing more is published, yet the headers of part 2 are there, which is what makes a browser paint part 1.
        viewer._skip_past(b"\r\n\r\n")


def test_a_stalled_viewer_slows_nobody(studio: Studio) -> None:
    studio.put(0)
    stalled = [Viewer(studio.server, receive_buffer=4096) for _ in range(5)]
    live = Viewer(studio.server)
    for number in range(1, 100):
        studio.put(number)
        while live.number() != number:
            pass
    assert studio.stream.viewers == 6
    for viewer in stalled:
        viewer.close()


def test_a_slow_viewer_sees_few_old_pictures(studio: Studio) -> None:
    """What lies in the sockets is all the delay there is: a few pictures, however long the reader paused."""
    studio.put(0)
    slow = Viewer(studio.server, receive_buffer=65536)
    live = Viewer(studio.server)
    for number in range(1, 200):
        studio.put(number)
        while live.number() != number:
            pass
    old = 0
    while slow.number() != 199:
        old += 1
    assert old < 10, f"{old} pictures waited in the sockets"


def test_stalled_viewers_take_no_memory(studio: Studio) -> None:
    studio.put(0)
    stalled = [Viewer(studio.server, receive_buffer=4096) for _ in range(20)]
    live = Viewer(studio.server)
    assert live.number() == 0

    def run(first: int, count: int) -> int:
        for number in range(first, first + count):
            studio.put(number)
            while live.number() != number:
                pass
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = run(1, 50)
    grown = run(51, 300) - before  # kB; queued for 20 viewers these pictures would be 342 MB
    assert grown < 10_000
    assert len(stalled) == studio.stream.viewers - 1


def test_a_viewer_that_takes_nothing_is_dropped() -> None:
    with Studio(timeout=0.3, max_viewers=2) as studio:
        studio.put(0)
        stalled = Viewer(studio.server, "/stream?name=stalled", receive_buffer=4096)
        assert stalled.status == 200
        assert studio.stream.stalled("stalled") is not None
        stop = threading.Event()

        def publish() -> None:
            while not stop.wait(0.02):
                studio.put(1)

        publisher = threading.Thread(target=publish)
        publisher.start()
        try:
            wait_until(lambda: studio.stream.viewers == 0)
            assert studio.stream.stalled("stalled") is None
        finally:
            stop.set()
            publisher.join()


def test_viewers_that_leave_are_noticed_without_new_pictures() -> None:
    with Studio(resend_period=0.05) as studio:
        studio.put(0)
        viewers = [Viewer(studio.server) for _ in range(8)]
        wait_until(lambda: studio.stream.viewers == 8)
        for number, viewer in enumerate(viewers):
            if number % 2:  # a reset instead of an orderly end
                viewer.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            viewer.close()
        wait_until(lambda: studio.stream.viewers == 0)
        assert not studio.image._listeners, "nobody watches, yet every picture wakes the server"


def test_the_last_picture_is_sent_again() -> None:
    with Studio(resend_period=0.05) as studio:
        studio.put(7)
        viewer = Viewer(studio.server)
        assert [viewer.number() for _ in range(4)] == [7] * 4


def test_limits_viewers_of_all_and_of_one_address() -> None:
    with Studio(max_viewers=3, max_viewers_per_address=2) as studio:
        studio.put(0)
        statuses = [Viewer(studio.server, f"/stream?address={a}").status for a in ("x", "x", "x", "y", "z")]
        assert statuses == [200, 200, 503, 200, 503]
        assert studio.stream.viewers == 3


def test_a_viewer_that_left_makes_room_for_another() -> None:
    with Studio(max_viewers_per_address=1, resend_period=0.05) as studio:
        studio.put(0)
        for _ in range(3):
            viewer = Viewer(studio.server)
            assert viewer.status == 200
            viewer.close()
            wait_until(lambda: studio.stream.viewers == 0)


def test_a_head_request_takes_no_viewers_place() -> None:
    with Studio(max_viewers=1) as studio:
        for _ in range(3):
            client = http.client.HTTPConnection(studio.server.address, studio.server.port, timeout=10)
            client.request("HEAD", "/stream")
            assert client.getresponse().status == 200
            client.close()
            wait_until(lambda: studio.stream.viewers == 0)


def test_long_poll_answers_with_the_next_picture(studio: Studio) -> None:
    client = http.client.HTTPConnection(studio.server.address, studio.server.port, timeout=10)

    def ask(after: int, timeout: float) -> http.client.HTTPResponse:
        client.request("GET", f"/next?after={after}&timeout={timeout}")
        return client.getresponse()

    answer = ask(0, 0)
    answer.read()
    assert answer.status == 204, "there is no picture yet"

    timer = threading.Timer(0.1, studio.put, [1])
    timer.start()
    answer = ask(0, 10)
    assert (answer.headers["X-Sequence"], answer.read()) == ("1", picture(1))
    studio.put(2)
    studio.put(3)
    answer = ask(1, 10)
    assert (answer.headers["X-Sequence"], answer.read()) == ("3", picture(3)), "the newest, not the next in line"
    answer = ask(3, 0.05)
    answer.read()
    assert answer.status == 204
    client.close()


def test_pictures_from_several_threads_all_wake_the_viewer(studio: Studio) -> None:
    studio.put(0)
    viewer = Viewer(studio.server)
    viewer.number()
    threads = [threading.Thread(target=lambda: [studio.put(1) for _ in range(200)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    studio.put(2)
    while viewer.number() != 2:
        pass


def test_closing_ends_streams_thread_and_port() -> None:
    with Studio() as studio:
        studio.put(0)
        viewer = Viewer(studio.server)
        viewer.number()
        port = studio.server.port
    with pytest.raises((EOFError, ConnectionError, ValueError)):
        while True:
            viewer.part()
    assert f"web-server-{port}" not in {thread.name for thread in threading.enumerate()}
    assert studio.stream.viewers == 0
    listener("127.0.0.1", port).close()


def test_garbage_on_the_wire_harms_nobody(studio: Studio, capfd: pytest.CaptureFixture[str]) -> None:
    studio.put(0)
    for request_line in (b"\0" * 100, b"GET / HTTP/1.1\r\nContent-Length: x\r\n\r\n", b"GET " + b"a" * 100_000, b"GE"):
        with socket.create_connection((studio.server.address, studio.server.port)) as peer:
            peer.sendall(request_line)
    assert Viewer(studio.server).number() == 0
    assert "Traceback" not in capfd.readouterr().err


def test_a_thousand_connections_that_send_nothing_keep_nobody_out(studio: Studio) -> None:
    studio.put(0)
    early = Viewer(studio.server)
    assert early.number() == 0
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    silent = [socket.socket() for _ in range(1000)]
    try:
        for connection in silent:
            connection.setblocking(False)
            assert connection.connect_ex((studio.server.address, studio.server.port)) in (0, errno.EINPROGRESS)
        for number in range(1, 6):
            studio.put(number)
            assert early.number() == number, "who watches is not disturbed"
        queued = select.poll()
        queued.register(silent[-1], select.POLLOUT)
        assert queued.poll(30_000), "all of them are in the queue"
        late = Viewer(studio.server)  # within its own timeout
        assert late.number() == 5, "who comes later gets in"
        late.close()
    finally:
        for connection in silent:
            connection.close()
    early.close()
