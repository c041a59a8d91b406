"""As many browsers as the page takes are there, all of them guests, when somebody with an account comes."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from page_in_process import PageInProcess
from page_server import ANNA
from page_stranger import FORWARD, Pilot, Stranger, says_goodbye

from telepresence.page import browser_messages, tabs
from telepresence.page.tabs import MOST_LINKS


@pytest.fixture
def page(tmp_path: Path) -> Iterator[PageInProcess]:
    served = PageInProcess(tmp_path)
    yield served
    served.close()


def test_the_newest_guest_makes_room_and_the_one_who_drives_stays(
    page: PageInProcess, wait_until: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The lab's drive_lease lets in whoever has a name: here everybody but anna counts as a guest.
    monkeypatch.setattr(tabs, "is_guest_name", lambda name: name != ANNA["name"])
    monkeypatch.setattr(browser_messages, "SILENCE", 60.0)  # the others have nothing to say
    stranger, robot = Stranger(page.url), page.robots["Pepper"]
    with contextlib.ExitStack() as opened:
        first = opened.enter_context(Pilot(stranger, stranger.enter(name="lena", password="")))
        wait_until(lambda: first.had[-1:] == ["I"] and robot.velocity.vx == FORWARD[0], "the first guest drives")
        others = [
            opened.enter_context(stranger.open(stranger.enter(name=f"guest{number}", password="")))
            for number in range(1, MOST_LINKS)
        ]
        assert not first.hung_up
        with stranger.open(stranger.enter(**ANNA)) as anna:
            assert "state" in next(text for text in anna if isinstance(text, str))
            assert says_goodbye(others[-1])
            first.had.clear()
            wait_until(lambda: len(first.had) > 5, "the first guest is told more")
            assert not first.hung_up and set(first.had) == {"I"} and robot.velocity.vx == FORWARD[0]
