"""What the web server says about its port; its behaviour under load is tested with pictures, in video/test_mjpeg.py."""

from __future__ import annotations

import errno
import logging

import pytest
from flask import Flask

from telepresence.web.listener import listener
from telepresence.web.server import WebServer


def test_a_taken_port_is_named_in_the_error() -> None:
    with listener("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(OSError, match=f"127.0.0.1, port {port}") as caught:
            listener("127.0.0.1", port)
    assert caught.value.errno == errno.EADDRINUSE


def test_listening_everywhere_is_warned_about(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        WebServer(Flask(__name__), "0.0.0.0").close()
    assert "every network" in caplog.text
