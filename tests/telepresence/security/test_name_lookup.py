"""Names that are looked up in time, and what is known from before when they are not."""

from __future__ import annotations

import socket
import threading

import pytest

from telepresence.security.name_lookup import BELIEVED, NameLookup


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def test_an_address_is_known_without_anybody_being_asked(monkeypatch):
    monkeypatch.setattr(threading.Thread, "start", lambda _: pytest.fail("a thread"))
    assert NameLookup("127.0.0.1", 80).addresses(0.0)[0][4] == ("127.0.0.1", 80)


@pytest.mark.parametrize("name", ["a..b", "x" * 70])
def test_what_is_no_name_is_an_error(name):
    with pytest.raises(OSError):
        NameLookup(name, 80).addresses(30.0)


@pytest.mark.parametrize("doubted", [True, False])
def test_the_old_answer_counts_until_another_comes(monkeypatch, wait_until, doubted):
    now, slow = Clock(), threading.Event()
    place = ["127.0.0.1"]
    really = socket.getaddrinfo

    def look_up(host, port, flags=0, **more):
        if flags & socket.AI_NUMERICHOST:
            raise socket.gaierror
        slow.wait(30.0)
        return really(place[0], port, **more)

    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    slow.set()
    lookup = NameLookup("robotino.test", 80, now)
    assert lookup.addresses(30.0)[0][4][0] == "127.0.0.1"
    slow.clear()
    place[0] = "127.0.0.2"
    if doubted:
        lookup.doubt()
    else:
        now.now += BELIEVED
    assert lookup.addresses(0.01)[0][4][0] == "127.0.0.1"
    slow.set()
    wait_until(lambda: lookup.addresses(0.01)[0][4][0] == "127.0.0.2", "the new answer counts")
