"""What strangers send makes few lines in the log, and a mistake of ours a whole traceback."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time

import pytest
from aiohttp import web

from telepresence.security.log_flood import BURST
from telepresence.web.request_log import request_log

UNREADABLE = [
    b"GET / HTTP/1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost\r\n\r\n",
    b"GET / HTTP/1.1\r\nContent-Length: x\r\n\r\n",
    b"GET /" + bytes([97]) * 20000 + b" HTTP/1.1\r\n\r\n",
    b"POST / HTTP/1.1\r\nContent-Encoding: gzip\r\nContent-Length: 5\r\n\r\nhello",
]


def answers(*requests: bytes, name: str) -> list[bytes]:
    """Return the first bytes of what a server answers, whose only page reads the body and divides by its length."""

    async def page(request: web.Request) -> web.Response:
        return web.Response(text=str(1 / len(await request.read())))

    async def ask_all() -> list[bytes]:
        application = web.Application()
        application.router.add_route("*", "/", page)
        runner = web.AppRunner(application, access_log=None, logger=request_log(name))
        await runner.setup()
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        got = []
        for request in requests:
            reader, writer = await asyncio.open_connection(*runner.addresses[0])
            writer.write(request)
            got.append(await reader.read(100))
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()
        await runner.cleanup()
        return got

    return asyncio.run(ask_all())


@pytest.mark.parametrize("request_", UNREADABLE, ids=lambda request: request[:20].decode("latin-1"))
def test_what_cannot_be_read_is_one_line(caplog, request_):
    caplog.set_level(logging.INFO)
    answers(request_, name=f"test {request_[:20]!r}")
    (record,) = caplog.records
    assert record.levelno == logging.INFO and not record.exc_info
    assert "127.0.0.1" in record.getMessage() and "\n" not in record.getMessage()


def test_a_flood_of_it_is_a_line_a_second(caplog):
    caplog.set_level(logging.INFO)
    began = time.monotonic()
    got = answers(*UNREADABLE[:3] * 50, name="test of a flood")
    assert len(got) == 150 and all(b" 400 " in answer for answer in got)
    assert BURST <= len(caplog.records) <= BURST + 1 + time.monotonic() - began


def test_a_mistake_of_ours_is_told_whole(caplog):
    answers(b"GET / HTTP/1.1\r\nHost: here\r\n\r\n", name="test of a mistake")
    (record,) = caplog.records
    assert record.levelno == logging.ERROR and "ZeroDivisionError" in caplog.text and "in page" in caplog.text
