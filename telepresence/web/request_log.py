"""What an aiohttp server logs of its requests: mistakes of ours whole, what strangers send as a line a second at most.

aiohttp writes a traceback for every request that it cannot read.
"""

from __future__ import annotations

import logging

from aiohttp import web
from aiohttp.http_exceptions import HttpProcessingError

from telepresence.security.log_flood import LogFlood

_OF_THE_SENDER = (HttpProcessingError, web.RequestPayloadError, ConnectionError)


def request_log(name: str) -> logging.Logger:
    """Return the logger for `aiohttp.web.AppRunner`.

    Args:
        name: Of the module whose server it is.
    """
    log = logging.getLogger(f"{name}.requests")
    if not log.filters:
        log.addFilter(_without_traceback)
        log.addFilter(LogFlood())
    return log


def _without_traceback(record: logging.LogRecord) -> bool:
    error = record.exc_info[1] if record.exc_info else None
    if isinstance(error, _OF_THE_SENDER):
        record.msg, record.args = f"{record.getMessage()}: {type(error).__name__}", None
        record.exc_info, record.levelno, record.levelname = None, logging.INFO, "INFO"
    return True
