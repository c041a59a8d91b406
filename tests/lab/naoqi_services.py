"""Services that try NAOqi's messaging, written for the vendor's `qi` and served by either library; also the program
that serves them: `python naoqi_services.py LIBRARY [--port N]` prints one line of JSON and ends with its input.

The first service has its members under the numbers that the recorded conversations use (`Recorded`, service 2).
"""

from __future__ import annotations

import argparse
import collections
import importlib
import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

VENDOR, OURS = "qi", "telepresence.naoqi"
LIBRARIES = (VENDOR, OURS)
PLAYS_2_5 = "+MetaObjectCache:-ObjectPtrUID:-RelativeEndpointURI"
"""`QI_TRANSPORT_CAPABILITIES` that make libqi talk as NAOqi 2.5 does."""
SIGNATURES = (
    "b", "c", "C", "w", "W", "i", "I", "l", "L", "f", "d", "s", "r", "m", "[i]", "[f]", "[s]", "[m]", "[[i]]", "{ss}",
    "{sm}", "{is}", "(is)", "(fs[i])", "+i", "+s", "[(is)]", "{s[f]}", "(is)<Named,number,text>",
)  # fmt: skip
USER, PASSWORD = "nao", "pepper's own"
"""User and password with which our server, playing 2.9, lets somebody in."""
LARGEST = 1 << 21
"""Bytes that a method returns, whatever it is asked for."""
RETURNS_MEMORY = {"MALLOC_MMAP_THRESHOLD_": "131072", "MALLOC_TRIM_THRESHOLD_": "131072", "MALLOC_ARENA_MAX": "2"}
"""What is freed goes back to the system at once, so that what is not can be seen."""
ROOT = Path(__file__).resolve().parents[2]


def signed(parameters: str, result: str, name: str | None = None) -> Callable:
    """Give a method these types, and perhaps another name, as `qi.bind` does."""

    def mark(method: Callable) -> Callable:
        method.__qi_signature__ = parameters
        method.__qi_return_signature__ = result
        if name:
            method.__qi_name__ = name
        return method

    return mark


def values_service(qi: Any) -> type:
    """`echoN` takes and returns SIGNATURES[N]; `gotN` says what a method is handed."""

    def make(signature: str, result: str, function: Callable[[Any], Any]) -> Callable:
        return signed(f"({signature})", result)(lambda self, value: function(value))

    members: dict[str, Any] = {}
    for number, signature in enumerate(SIGNATURES):
        members[f"echo{number}"] = make(signature, signature, lambda value: value)
        members[f"got{number}"] = make(signature, "s", lambda value: f"{type(value).__name__} {value!r}")
    return qi.multiThreaded()(type("Values", (), members))


def recorded_service(qi: Any) -> type:
    """Members in the order of their names: add is 100, level 114, told 115, wait 117."""

    class Recorded:
        def __init__(self) -> None:
            self.level = qi.Property("f")
            self.told = qi.Signal("(is)")

        @signed("(ii)", "i")
        def add(self, a: int, b: int) -> int:
            return a + b

        @signed("(m)", "m")
        def f113(self, value: Any) -> Any:
            return value

        @signed("(is)", "v")
        def v_tell(self, number: int, text: str) -> None:
            self.told(number, text)

        @signed("()", "v")
        def u(self) -> None:
            """It holds the number 116."""

        @signed("()", "i")
        def v(self) -> Any:
            self._open = qi.Promise(lambda cancelled: cancelled.setCanceled())
            return self._open.future()

    for number in range(101, 113):
        setattr(Recorded, f"f{number}", signed("()", "v")(lambda self: None))
    return Recorded


def conversation_service(qi: Any, session: Any) -> type:
    """Everything but values: overloads, errors, waiting, events, properties, objects, calls back."""

    class Subscriber:
        """As `ALMemory.subscriber` returns."""

        def __init__(self, name: str) -> None:
            self._name = name
            self.signal = qi.Signal("(m)")
            self.value = qi.Property("i")

        @signed("()", "s")
        def name(self) -> str:
            return self._name

        @signed("(m)", "v")
        def raiseEvent(self, value: Any) -> None:
            self.signal(value)

        @signed("()", "o")
        def child(self) -> Any:
            return Subscriber(self._name + "'")

    @qi.multiThreaded()
    class Conversation:
        def __init__(self) -> None:
            self.counted = qi.Signal("(is)")
            self.anything = qi.Signal("m")
            self.level = qi.Property("f")
            self.record = qi.Property("m")
            self.cancelled = 0
            self._open: collections.deque[Any] = collections.deque(maxlen=5000)
            """Promises that nobody keeps: libqi ends the future of one that is forgotten."""

        @signed("(i)", "s", "over")
        def over_i(self, value: int) -> str:
            return "i"

        @signed("(s)", "s", "over")
        def over_s(self, value: str) -> str:
            return "s"

        @signed("([f])", "s", "over")
        def over_list(self, value: list) -> str:
            return "[f]"

        @signed("(sb)", "s", "over")
        def over_two(self, text: str, flag: bool) -> str:
            return "sb"

        @signed("(mm)", "s", "over")
        def over_dynamic(self, a: Any, b: Any) -> str:
            return "mm"

        @signed("(s)", "i")
        def fail(self, text: str) -> int:
            raise ValueError(text)

        @signed("()", "i")
        def wrong(self) -> Any:
            return "no number"

        @signed("(i)", "m")
        def later(self, milliseconds: int) -> Any:
            promise = qi.Promise()
            timer = threading.Timer(min(max(milliseconds, 0), 1000) / 1e3, lambda: promise.setValue(milliseconds))
            timer.daemon = True
            timer.start()
            return promise.future()

        @signed("()", "m")
        def never(self) -> Any:
            def stop(promise: Any) -> None:
                self.cancelled += 1
                promise.setCanceled()

            promise = qi.Promise(stop)
            self._open.append(promise)
            return promise.future()

        @signed("()", "i")
        def cancels(self) -> int:
            return self.cancelled

        @signed("(ii)", "v")
        def count(self, begin: int, end: int) -> None:
            for number in range(begin, min(end, begin + 1000)):
                self.counted(number, f"number {number}")

        @signed("(m)", "v")
        def emit(self, value: Any) -> None:
            self.anything(value)

        @signed("(s)", "o")
        def subscriber(self, name: str) -> Any:
            return Subscriber(name)

        @signed("(s)", "m")
        def subscriber_inside(self, name: str) -> Any:
            return [name, Subscriber(name)]

        @signed("(o)", "s")
        def ask(self, other: Any) -> str:
            return f"the name is {other.name()}"

        @signed("(ssm)", "m")
        def call_back(self, service: str, method: str, arguments: list) -> Any:
            return session.service(service).call(method, *arguments)

        @signed("(r)", "i")
        def size(self, data: bytes) -> int:
            return len(data)

        @signed("(i)", "r")
        def data(self, size: int) -> bytes:
            return bytes(min(max(size, 0), LARGEST))

        @signed("(i)", "m")
        def picture(self, size: int) -> list:
            return [640, 480, 3, 11, 0, 0, bytearray(min(max(size, 0), LARGEST)), 0, 0.5, 0.4, -0.5, -0.4]

    return Conversation


def serve(library: str, port: int) -> tuple[str, Any]:
    """The address at which the services are, and the session to keep."""
    qi = importlib.import_module(library)
    session = qi.Session()
    session.listenStandalone(f"tcp://127.0.0.1:{port}")
    for name, service in services(qi, session).items():
        session.registerService(name, service)
    return next(url for url in session.endpoints() if "127.0.0.1" in url), session


def services(qi: Any, session: Any) -> dict[str, Any]:
    return {
        "Recorded": recorded_service(qi)(),
        "Values": values_service(qi)(),
        "Conversation": conversation_service(qi, session)(),
    }


class _Remotes:
    """A server's view of its clients' services, under the name that a session has for it."""

    def __init__(self, server: Any) -> None:
        self.service = server.remote


def serve_release(version: str, certificate: str, login_s: float) -> tuple[str, Any]:
    """The address of our server that plays a robot of this version, and the server; 2.9 with TLS and a login."""
    import ssl

    import telepresence.naoqi as qi
    from telepresence.naoqi.limits import Limits
    from telepresence.naoqi.python_object import served
    from telepresence.naoqi.releases import RELEASES
    from telepresence.naoqi.server import Server

    context = None
    if version == "2.9":
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate)
    server = Server(
        "tcps://127.0.0.1:0" if context else "tcp://127.0.0.1:0",
        release=RELEASES[version],
        login={USER: PASSWORD} if context else None,
        tls=context,
        limits=Limits(login_s=login_s),
    )
    for name, service in services(qi, _Remotes(server)).items():
        server.register(name, served(service))
    server.start()
    return server.endpoints[-1], server


class ServerProcess:
    """The program in a process of its own.

    Args:
        arguments: Of the command line, the library first.
        capabilities: For libqi, changes to what it announces.
    """

    def __init__(self, *arguments: str, capabilities: str = "") -> None:
        environment = {**os.environ, **RETURNS_MEMORY, "PYTHONPATH": str(ROOT)}
        if capabilities:
            environment["QI_TRANSPORT_CAPABILITIES"] = capabilities
        self.process = subprocess.Popen(
            [sys.executable, __file__, *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, text=True,
        )  # fmt: skip
        assert self.process.stdout
        line = self.process.stdout.readline()
        while line and not line.startswith("{"):  # libqi's log goes to the same place
            line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"{arguments} did not start: {self.process.wait(5.0)}")
        self.urls: dict[str, str] = json.loads(line)
        self.url = self.urls[""]
        self.port = int(self.url.rpartition(":")[2])

    @property
    def pid(self) -> int:
        return self.process.pid

    def kill(self) -> None:
        self.process.kill()
        self.close()

    def close(self) -> None:
        """End it, by its input first."""
        for stream in (self.process.stdin, self.process.stdout):
            if stream:
                stream.close()
        try:
            self.process.wait(5.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def __enter__(self) -> ServerProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("library", choices=LIBRARIES)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--release", nargs="*", default=[], help="robots that our server plays as well")
    parser.add_argument("--login-seconds", type=float, default=10.0, help="that our server gives a client to log in")
    parser.add_argument("--certificate", default="", help="for 2.9: a file with certificate and key")
    arguments = parser.parse_args()
    if arguments.library == VENDOR:
        import qi

        qi.logging.setLevel(qi.logging.FATAL)
    url, _session = serve(arguments.library, arguments.port)
    playing = {
        version: serve_release(version, arguments.certificate, arguments.login_seconds) for version in arguments.release
    }
    print(json.dumps({"": url, **{version: url for version, (url, _) in playing.items()}}), flush=True)
    sys.stdin.read()
    os._exit(0)  # libqi takes a second to end


if __name__ == "__main__":
    main()
