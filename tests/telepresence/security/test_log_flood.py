from __future__ import annotations

import logging

from telepresence.security.log_flood import BURST, MAX_LINE, LogFlood


def test_a_flood_is_one_line_a_second_and_says_how_much_it_was() -> None:
    now = [0.0]
    flood = LogFlood(lambda: now[0])

    def write(name: str = "camera", text: str = "no %s") -> str | None:
        record = logging.LogRecord(name, logging.WARNING, "", 0, text, ("key",) if "%" in text else (), None)
        return record.getMessage() if flood.filter(record) else None

    assert [write() for _ in range(BURST)] == ["no key"] * BURST
    assert write() is None and write() is None
    assert write("other") == "no key", "another logger has its own"
    now[0] = 1.0
    assert write() == "no key (and 2 lines that are left out)"
    assert write() is None
    now[0] = 100.0
    assert [write() for _ in range(BURST + 1)].count(None) == 1
    assert write("new", "a\x1b]0;b\n" + "c" * 5000) == "a ]0;b " + "c" * (MAX_LINE - 7)
