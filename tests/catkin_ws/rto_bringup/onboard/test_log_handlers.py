"""What the programs on the robot log: limited, and nothing of it stays behind in a process that only calls them."""

from __future__ import annotations

import logging

from rto_bringup.onboard.__main__ import log_handlers, main

from telepresence.security.log_flood import BURST


def test_what_strangers_cause_over_and_over_is_limited(capsys):
    [handler] = log_handlers()
    for _ in range(BURST + 5):
        handler.handle(logging.LogRecord("drive", logging.WARNING, "", 0, "no key", (), None))
    assert capsys.readouterr().err.count("no key") == BURST


def test_under_a_supervisor_only_warnings_go_to_standard_error(capsys, monkeypatch):
    monkeypatch.setenv("NOTIFY_SOCKET", "/run/systemd/notify")
    logger = logging.Logger("drive")
    logger.handlers = log_handlers()
    logger.info("a client came")
    logger.warning("no key")
    said = capsys.readouterr()
    assert said.err == "no key\n" and "a client came" in said.out and "no key" not in said.out


def test_handlers_of_others_are_left_alone():
    before = [list(handler.filters) for handler in logging.getLogger().handlers]
    assert main(["drive", "--port", "0", "--address", "192.0.2.1"]) == 1
    assert before and [handler.filters for handler in logging.getLogger().handlers] == before
