"""Debian's Firefox without a window, controlled by WebDriver BiDi (https://www.w3.org/TR/webdriver-bidi/)."""

from __future__ import annotations

import itertools
import json
import os
import re
import select
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from websockets.sync.client import connect

STARTS = 40.0
"""[s] until Firefox listens, on a busy machine."""
ANSWERS = 60.0
"""[s]"""
PREFERENCES = {
    "media.peerconnection.ice.loopback": True,
    "media.peerconnection.ice.obfuscate_host_addresses": False,
    "media.navigator.streams.fake": True,
    "media.navigator.permission.disabled": True,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "toolkit.telemetry.enabled": False,
    "app.update.enabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "services.settings.server": "data:,",
    "browser.safebrowsing.provider.mozilla.updateURL": "",
    "extensions.systemAddon.update.enabled": False,
}
"""What keeps it from asking anybody anything, and lets it reach this machine by WebRTC."""


class Firefox:
    """One browser process with one page in it.

    Args:
        before: A function in JavaScript that runs in each page before the page's own scripts.
    """

    def __init__(self, before: str = "() => {}") -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="firefox-", ignore_cleanup_errors=True)
        preferences = (f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in PREFERENCES.items())
        Path(self._folder.name, "user.js").write_text("\n".join(preferences))
        program = shutil.which("firefox-esr")
        assert program, "there is no firefox-esr; Debian's package of that name has it"
        words = ["--headless", "--no-remote", "--profile", self._folder.name, "--remote-debugging-port", "0"]
        self._process = subprocess.Popen(
            [program, *words, "about:blank"],
            env=os.environ | {"HOME": self._folder.name},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        self._numbers = itertools.count(1)
        try:
            self._socket = connect(f"{self._address()}/session", max_size=None, open_timeout=ANSWERS)
            self.call("session.new", capabilities={"alwaysMatch": {"acceptInsecureCerts": True}})
            self._page = self.call("browsingContext.create", type="window")["context"]  # the first has not the focus
            self.call("script.addPreloadScript", functionDeclaration=before)
        except BaseException:
            self.close()
            raise

    def _address(self) -> str:
        said, stream, deadline = b"", self._process.stderr, time.monotonic() + STARTS
        while not (found := re.search(rb"listening on (ws://\S+)", said)):
            ready, _, _ = select.select([stream], [], [], max(0.0, deadline - time.monotonic()))
            more = os.read(stream.fileno(), 65536) if ready else b""
            assert more, f"Firefox does not listen: {said!r}"
            said += more
        threading.Thread(target=stream.read, daemon=True).start()  # who is not read stands still
        return found[1].decode()

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Send a command and return its result; raises RuntimeError when it is refused."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            answer = json.loads(self._socket.recv(ANSWERS))
            if answer.get("id") == number:
                break
        if answer["type"] != "success":
            raise RuntimeError(f"{method}: {answer['error']}: {answer['message']}")
        return answer["result"]

    def navigate(self, url: str) -> None:
        self.call("browsingContext.navigate", context=self._page, url=url, wait="interactive")

    def resize(self, width: int, height: int) -> None:
        """Set the size of the page [pixel]."""
        self.call("browsingContext.setViewport", context=self._page, viewport={"width": width, "height": height})

    def evaluate(self, expression: str) -> Any:
        """Return what a script comes to, as if somebody had pressed something; raises RuntimeError when it throws."""
        answer = self.call(
            "script.evaluate",
            expression=expression,
            target={"context": self._page},
            awaitPromise=True,
            userActivation=True,
        )
        if answer["type"] == "exception":
            raise RuntimeError(answer["exceptionDetails"]["text"])
        return _value(answer["result"])

    def key(self, key: str, down: bool) -> None:
        """Press or release a key, by the character that it types."""
        actions = [{"type": "keyDown" if down else "keyUp", "value": key}]
        source = {"type": "key", "id": "keyboard", "actions": actions}
        self.call("input.performActions", context=self._page, actions=[source])

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the browser and all its children."""
        os.killpg(self._process.pid, number)

    def close(self) -> None:
        """End the browser and all its processes."""
        try:
            os.killpg(self._process.pid, signal.SIGKILL)  # it has nothing to save
        except ProcessLookupError:
            pass
        self._process.wait(10.0)
        self._folder.cleanup()


def _value(result: dict[str, Any]) -> Any:
    """Return a value of JavaScript as BiDi writes it (8.11.1, script.RemoteValue) as one of Python's."""
    match result["type"]:
        case "array":
            return [_value(one) for one in result["value"]]
        case "object":
            return {key: _value(value) for key, value in result["value"]}
    return result.get("value")
