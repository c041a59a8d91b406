"""What of a browser's messages counts, whatever carries them."""

import asyncio
import json

import pytest

from telepresence.page import commands
from telepresence.page.browser_messages import BrowserMessages, StationEnd
from telepresence.page.commands import Request, Who, read_text

DRIVE = {"n": 1, "t": 1.0, "v": None, "hold": ""}


class Window:
    def __init__(self):
        self.mine, self.driven, self.asked = False, [], []

    def drive(self, message, now):
        self.driven.append(message.number)
        return len(self.driven) == 1

    def ask(self, message):
        self.asked.append(message.action)


class Browser:
    def __init__(self):
        self.window, self.sent, self.done = Window(), [], []
        self.messages = BrowserMessages(
            StationEnd(self.window, lambda: {"gate": None}, self.carry_out),
            lambda kind, text: self.sent.append((kind, text)),
        )

    async def carry_out(self, action, value):
        if value == "bad":
            raise ValueError("Not that.")
        self.done.append((action, value))

    def receive(self, kind, fields):
        self.messages.receive(kind, json.dumps(fields))

    def answers(self):
        return [json.loads(text) for kind, text in self.sent if kind == "ask"]


@pytest.fixture
def browser(monkeypatch):
    monkeypatch.setitem(commands.REQUESTS, "say", Request(Who.DRIVER, read_text))
    return Browser()


def test_a_command_that_was_passed_on_is_answered(browser):
    browser.receive("drive", DRIVE)
    browser.receive("drive", DRIVE)
    assert browser.window.driven == [1, 1] and browser.sent == [("drive", '{"n":1}')]


@pytest.mark.parametrize(
    ("kind", "text"),
    [("drive", "x"), ("ask", "x"), ("ask", b"{}"), ("drive", "[" * 900), ("other", "{}"), ("ask", '{"do": "fly"}')],
)
def test_what_no_page_of_ours_sends_is_counted_and_does_nothing(browser, kind, text):
    browser.messages.receive(kind, text)
    assert browser.messages.bad == 1 and browser.sent == [] and browser.window.driven == browser.window.asked == []


def test_only_who_has_the_robot_may_ask_for_what_is_the_driver_s(browser):
    async def run():
        for number, (mine, words) in enumerate([(False, "hello"), (True, "hello"), (True, "bad")], start=1):
            browser.window.mine = mine
            browser.receive("ask", {"id": number, "do": "say", "with": words})
        browser.receive("ask", {"id": 4, "do": "stop", "with": None})
        await asyncio.sleep(0.01)

    asyncio.run(run())
    assert browser.done == [("say", "hello")] and browser.window.asked == ["stop"]
    assert [(answer["id"], answer["text"]) for answer in browser.answers()] == [
        (1, "Take the robot first."), (4, ""), (2, ""), (3, "Not that."),
    ]  # fmt: skip


def test_the_state_says_what_station_and_connection_know(browser):
    browser.messages.report({"picture": None})
    assert browser.sent == [("state", '{"gate":null,"picture":null}')]
