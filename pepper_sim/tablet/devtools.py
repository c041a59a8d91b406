"""Chromium without a window, controlled over the DevTools protocol.

Format: JSON texts, each ended by a zero byte, over two pipes that Chromium has as file descriptors 3 (it reads) and 4
(it writes): its option `--remote-debugging-pipe`. A request is {id, method, params, sessionId}, a reply
{id, result | error}, an event {method, params, sessionId}. No port is opened, so no other program can control the
browser.
"""

from __future__ import annotations

import contextlib
import fcntl
import itertools
import json
import logging
import os
import shutil
import signal
import subprocess
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from pathlib import Path
from typing import Any

from telepresence.temporary_folder import TemporaryFolder

log = logging.getLogger(__name__)

REPLY_TIMEOUT = 10.0
"""[s]"""
START_TIMEOUT = 40.0
"""Seconds for the first answer: Chromium starts within one, or in 15 beside a station that starts on a slow machine."""
_MESSAGE_LIMIT = 64_000_000  # bytes
_SOCKET_FOLDER = "org.chromium.Chromium."
"""Begins the name of the temporary folder that Chromium makes for its socket."""
_FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --disable-default-apps --disable-extensions --mute-audio "
    "--hide-scrollbars --no-proxy-server --remote-debugging-pipe"
).split()


class BrowserError(RuntimeError):
    """Chromium is missing, has ended, or refused a request."""


class DevTools:
    """One browser process with one page in it.

    Args:
        on_event: Called on the reader's thread with an event's method and parameters.
        flags: Further words of Chromium's command line.
        niceness: How far it stands behind other programs.
    Raises:
        BrowserError: There is no Chromium, or it does not start.
    """

    def __init__(
        self,
        on_event: Callable[[str, dict[str, Any]], None] = lambda method, params: None,
        flags: Sequence[str] = (),
        niceness: int = 0,
    ) -> None:
        program = shutil.which("chromium")
        if program is None:
            raise BrowserError("there is no program chromium here; Debian's package of that name has it")
        self._on_event = on_event
        self._ids = itertools.count(1)
        self._replies: dict[int, Future[dict[str, Any]]] = {}
        self._lock = threading.Lock()
        self._session: str | None = None
        self._profile = TemporaryFolder("tablet-", _remove_socket)
        profile = f"--user-data-dir={self._profile.path}"
        from_us, self._requests = _pipe()
        self._answers, to_us = _pipe()
        # The shell gives the pipes the numbers that Chromium expects. The process group is its own: Chromium has many
        # children.
        shell = f'exec nice -n {niceness} "$@" 3<&{from_us} 4>&{to_us}'
        self._process = subprocess.Popen(
            ["bash", "-c", shell, "bash", program, *_FLAGS, *flags, profile, "about:blank"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=(from_us, to_us),
            start_new_session=True,
        )
        os.close(from_us)
        os.close(to_us)
        self._reader = threading.Thread(target=self._read, name="tablet-chromium", daemon=True)
        self._reader.start()
        try:
            targets = self._call("Target.getTargets", {}, START_TIMEOUT)["targetInfos"]
            page = next(target["targetId"] for target in targets if target["type"] == "page")
            self._session = self.call("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]
        except (BrowserError, StopIteration) as error:
            self.close()
            raise BrowserError(f"{program} does not start: {error or 'it has no page'}") from error

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Send a request and return its result; it has `REPLY_TIMEOUT` seconds.

        Raises:
            BrowserError: The request was refused or not answered, or the browser has ended.
        """
        return self._call(method, params, REPLY_TIMEOUT)

    def _call(self, method: str, params: dict[str, Any], timeout: float) -> dict[str, Any]:
        number, reply = self._send(method, params)
        try:
            answer = reply.result(timeout)
        except FutureTimeout:
            with self._lock:
                self._replies.pop(number, None)
            raise BrowserError(f"{method}: no answer within {timeout:g} s") from None
        if "error" in answer:
            raise BrowserError(f"{method}: {answer['error'].get('message')}")
        return answer["result"]

    def post(self, method: str, **params: Any) -> None:
        """Send a request without waiting, as the reader's own thread must not wait. Errors are only logged."""
        try:
            self._send(method, params)
        except BrowserError as error:
            log.debug("%s", error)

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the browser and all its children."""
        os.killpg(self._process.pid, number)

    def close(self) -> None:
        """End the browser and all its processes."""
        try:
            os.killpg(self._process.pid, signal.SIGKILL)  # it has nothing to save
        except ProcessLookupError:
            pass
        self._process.wait(5.0)
        self._reader.join(5.0)
        with self._lock:
            if self._requests >= 0:
                os.close(self._requests)
                self._requests = -1
        self._profile.close()

    def _send(self, method: str, params: dict[str, Any]) -> tuple[int, Future[dict[str, Any]]]:
        reply: Future[dict[str, Any]] = Future()
        with self._lock:
            number = next(self._ids)
            message = {"id": number, "method": method, "params": params}
            if self._session is not None:
                message["sessionId"] = self._session
            self._replies[number] = reply
            data = json.dumps(message).encode() + b"\0"
            try:
                while data:
                    data = data[os.write(self._requests, data) :]
            except OSError:
                self._replies.pop(number, None)
                raise BrowserError(f"{method}: the browser has ended") from None
        return number, reply

    def _read(self) -> None:
        buffer = bytearray()
        try:
            while data := os.read(self._answers, 1_000_000):
                buffer += data
                *messages, rest = buffer.split(b"\0")
                buffer = bytearray(rest)
                for message in messages:
                    self._dispatch(json.loads(message))
                if len(buffer) > _MESSAGE_LIMIT:
                    raise BrowserError("a message of the browser is too long")
        except Exception:  # top of the reader's thread, which calls `on_event` of its owner
            log.exception("the link to chromium failed")
        finally:
            os.close(self._answers)
            with self._lock:
                waiting, self._replies = list(self._replies.values()), {}
            for reply in waiting:
                reply.set_result({"error": {"message": "the browser has ended"}})

    def _dispatch(self, message: dict[str, Any]) -> None:
        if "id" in message:
            with self._lock:
                reply = self._replies.pop(message["id"], None)
            if reply is not None:
                reply.set_result(message)
        elif "method" in message:
            self._on_event(message["method"], message.get("params", {}))


def _remove_socket(profile: Path) -> None:
    """Remove the temporary folder in which a Chromium that was killed has its socket: its profile links there."""
    with contextlib.suppress(OSError):  # there is no such link
        folder = (profile / "SingletonSocket").readlink().parent
        if folder.name.startswith(_SOCKET_FOLDER):
            shutil.rmtree(folder, ignore_errors=True)


def _pipe() -> tuple[int, int]:
    """Open a pipe; return its reading and its writing end, neither of them descriptor 3 or 4."""
    ends = os.pipe()
    moved = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in ends]
    for end in ends:
        os.close(end)
    return moved[0], moved[1]
