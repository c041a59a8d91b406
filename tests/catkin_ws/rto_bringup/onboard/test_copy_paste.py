"""Signaling by hand, with people who take their time and paste the wrong thing. Only the clock is not real: each test
has an event loop whose time can be moved on, and whatever waits in it, of ours or of aiortc, waits by that time."""

from __future__ import annotations

import asyncio
import io
import json
import os
import re
from collections.abc import Callable, Coroutine

import pytest
from aiortc.contrib.signaling import object_from_string
from rto_bringup.onboard.camera_server import CameraServer
from rto_bringup.onboard.picture_sources import open_source
from rto_node.webrtc_camera import receive_by_copy_and_paste

from telepresence.video.copy_paste_signaling import LONGEST_LINE, MOST_LINES, CopyPasteSignaling, parse

LOOPBACK = "127.0.0.1"
DEADLINE = 20.0
"""[s]"""


class Loop(asyncio.SelectorEventLoop):
    ahead = 0.0

    def time(self) -> float:
        return super().time() + self.ahead

    async def pass_time(self, seconds: float) -> None:
        """Let that time pass, in steps that are short enough for what answers in between to do so."""
        for _ in range(round(seconds / 0.25)):
            self.ahead += 0.25
            await asyncio.sleep(0.0)
            await asyncio.sleep(0.0)


class Terminal:
    """What a person sees of one program, and types into it."""

    def __init__(self, work: Callable[[CopyPasteSignaling], Coroutine]) -> None:
        source, self._keys = os.pipe()
        self._closed = False
        self.screen = io.StringIO()
        self.program = asyncio.ensure_future(work(CopyPasteSignaling("the other terminal", source, self.screen)))

    def paste(self, *lines: str) -> None:
        os.write(self._keys, "".join(f"{line}\n" for line in lines).encode())

    async def shows(self, pattern: str) -> str:
        """Return what the pattern finds on the screen, once it does."""
        for _ in range(round(DEADLINE / 0.01)):
            if found := re.search(pattern, self.screen.getvalue(), re.MULTILINE):
                return found[0]
            if self.program.done():
                self.program.result()
            await asyncio.sleep(0.01)
        raise AssertionError(f"no {pattern!r} in {self.screen.getvalue()}")

    async def line(self, kind: str) -> str:
        """Return the newest line of that kind."""
        await self.shows(rf'^{{.*"type": "{kind}"}}$')
        return [each for each in self.screen.getvalue().splitlines() if each.endswith(f'"type": "{kind}"}}')][-1]

    def clear(self) -> None:
        self.screen.seek(0)
        self.screen.truncate()

    async def close(self) -> None:
        self.program.cancel()
        await asyncio.gather(self.program, return_exceptions=True)
        if not self._closed:
            self._closed = True
            os.close(self._keys)  # ends the thread that reads the other end


class Pair:
    """The sender's terminal, the receiver's, and the pictures that came."""

    def __init__(self) -> None:
        self.loop = asyncio.get_running_loop()
        self.source = open_source("test", 15.0, (160, 120))
        server = CameraServer(self.source)
        self.sender = Terminal(lambda signaling: server.send_by_copy_and_paste(signaling, LOOPBACK))
        self.pictures = 0
        self.receiver = self.open_receiver()

    def open_receiver(self) -> Terminal:
        def take(_frame) -> None:
            self.pictures += 1

        return Terminal(lambda signaling: receive_by_copy_and_paste(signaling, take, LOOPBACK))

    async def pictures_come(self) -> None:
        before = self.pictures
        for _ in range(round(DEADLINE / 0.01)):
            if self.pictures > before:
                return
            await asyncio.sleep(0.01)
        raise AssertionError(f"no picture\n{self.sender.screen.getvalue()}\n{self.receiver.screen.getvalue()}")

    async def carry(self) -> None:
        """Copy the offer over, and the answer back."""
        self.receiver.paste(await self.sender.line("offer"))
        self.sender.paste(await self.receiver.line("answer"))


def run(test: Callable[[Pair], Coroutine]) -> None:
    async def whole() -> None:
        pair = Pair()
        try:
            await test(pair)
        finally:
            await pair.sender.close()
            await pair.receiver.close()
            pair.source.close()

    with asyncio.Runner(loop_factory=Loop) as runner:
        runner.run(whole())


def test_a_person_takes_a_minute_for_each_line():
    async def test(pair: Pair) -> None:
        offer = await pair.sender.line("offer")
        await pair.loop.pass_time(65.0)
        pair.receiver.paste(offer)
        answer = await pair.receiver.line("answer")
        await pair.loop.pass_time(65.0)
        pair.sender.paste(answer)
        await pair.pictures_come()

    run(test)


def test_each_terminal_says_which_line_goes_where():
    async def test(pair: Pair) -> None:
        await pair.sender.shows("Copy the next line, from { to }, into the other terminal")
        await pair.sender.shows("Paste here the line that the receiver prints, then press Enter")
        await pair.receiver.shows("Paste here the line that the sender printed, then press Enter")
        await pair.carry()
        for terminal in (pair.sender, pair.receiver):
            await terminal.shows("Connected")

    run(test)


def test_wrong_lines_are_explained_and_asked_for_again():
    async def test(pair: Pair) -> None:
        offer = await pair.sender.line("offer")
        for line, reason in (
            (offer, "this is the line that this program printed itself"),
            ("ls", "it is not one whole line"),
            (offer[:100], "it is not one whole line"),
            ('{"type": "hello"}', "it is neither offer, answer, candidate nor bye"),
            ('{"type": "answer", "sdp": "v=0"}', "this answer cannot be understood"),
        ):
            pair.sender.paste(line)
            await pair.sender.shows(f"Not taken: {re.escape(reason)}")
            pair.sender.clear()
        pair.receiver.paste('{"type": "answer", "sdp": "v=0"}')
        await pair.receiver.shows("Not taken: this is an answer, and an offer is needed")
        pair.receiver.paste('{"type": "offer", "sdp": "v=0\\r\\n"}')
        await pair.receiver.shows("Not taken: this offer")
        pair.receiver.paste("-- Please send this message to the remote party --", "", offer)
        pair.sender.paste(await pair.receiver.line("answer"))
        await pair.pictures_come()

    run(test)


def test_pasted_candidates_are_taken():
    """The offer names no address; candidates come as lines of their own, one before the offer and one after it."""

    async def test(pair: Pair) -> None:
        offer = json.loads(await pair.sender.line("offer"))
        candidate = re.search(r"^a=(candidate:.*)\r$", offer["sdp"], re.MULTILINE)[1]
        offer["sdp"] = re.sub(r"^a=(candidate:.*|end-of-candidates)\r\n", "", offer["sdp"], flags=re.MULTILINE)
        other = candidate.replace(candidate.split()[5], "9", 1)
        pair.receiver.paste(json.dumps({"type": "candidate", "candidate": other, "sdpMid": "0", "sdpMLineIndex": 0}))
        pair.receiver.paste(json.dumps(offer))
        answer = json.loads(await pair.receiver.line("answer"))
        answer["sdp"] = re.sub(r"^a=candidate:.*\r\n", "", answer["sdp"], flags=re.MULTILINE)
        pair.sender.paste(json.dumps(answer))
        await pair.receiver.shows(r"Candidate taken: 127\.0\.0\.1, port 9\.")
        assert pair.pictures == 0
        pair.receiver.paste(json.dumps({"candidate": candidate, "id": "0", "label": 0, "type": "candidate"}))
        await pair.pictures_come()
        pair.receiver.paste('{"candidate": "candidate:1 1 udp", "id": "0", "label": 0, "type": "candidate"}')
        await pair.receiver.shows("Not taken: this candidate cannot be understood")

    run(test)


def test_goodbye_ends_each_side_in_the_guides_words():
    async def test(pair: Pair) -> None:
        await pair.carry()
        await pair.pictures_come()
        pair.receiver.paste('{"type": "bye"}')
        await asyncio.wait_for(pair.receiver.program, DEADLINE)
        assert "Exiting.." in pair.receiver.screen.getvalue()
        pair.sender.paste(await pair.receiver.line("bye"))
        await asyncio.wait_for(pair.sender.program, DEADLINE)
        assert "Exiting.." in pair.sender.screen.getvalue()

    run(test)


def test_a_receiver_that_is_lost_gets_a_new_offer():
    async def test(pair: Pair) -> None:
        await pair.carry()
        await pair.pictures_come()
        await pair.sender.shows("Connected")
        pair.sender.clear()
        await pair.receiver.close()
        await pair.loop.pass_time(10.0)
        await pair.sender.shows("The receiver is gone")
        pair.receiver = pair.open_receiver()
        await pair.carry()
        await pair.pictures_come()

    run(test)


def test_a_missing_connection_is_explained_and_a_new_answer_brings_a_new_offer():
    async def test(pair: Pair) -> None:
        pair.receiver.paste(await pair.sender.line("offer"))
        answer = json.loads(await pair.receiver.line("answer"))
        answer["sdp"] = re.sub(r"^a=ice-pwd:.*\r$", "a=ice-pwd:" + 22 * "x" + "\r", answer["sdp"], flags=re.MULTILINE)
        pair.sender.paste(json.dumps(answer))
        await asyncio.sleep(0.2)
        await pair.loop.pass_time(15.0)
        await pair.sender.shows("No connection yet")
        pair.sender.clear()
        pair.sender.paste(json.dumps(answer))
        await pair.sender.shows("Here is a new offer")
        pair.receiver.clear()
        await pair.carry()
        await pair.pictures_come()

    run(test)


def test_input_that_ends_is_an_error_before_the_exchange_and_none_after_it():
    async def test(pair: Pair) -> None:
        ended = os.open(os.devnull, os.O_RDONLY)
        try:
            with pytest.raises(ValueError, match="run this in a terminal"):
                await receive_by_copy_and_paste(CopyPasteSignaling("", ended, io.StringIO()), lambda _: None)
        finally:
            os.close(ended)

    run(test)


def test_a_line_that_a_terminal_cut_is_named():
    with pytest.raises(ValueError, match="no line longer than 4095"):
        parse('{"sdp": "' + 5000 * "x")


def test_the_lines_are_aiortcs():
    assert parse('{"type": "bye"}') is object_from_string('{"type": "bye"}')


@pytest.mark.parametrize(
    "line",
    [
        "[" * 60_000,
        '{"type": ' * 10_000,
        '{"type": "offer", "sdp": ' + "9" * 5000 + "}",
        '{"type": "offer", "sdp": ["v=0"]}',
        '{"type": "offer", "sdp": "' + "a=x\\r\\n" * 5000 + '"}',
        '{"type": "offer", "sdp": "m=application 9 UDP/DTLS/SCTP webrtc-datachannel"}',
        '{"type": "candidate", "id": [], "label": {}, "candidate": 7}',
        '{"type": "candidate", "id": "0", "label": 0, "candidate": "candidate:1 1 udp x"}',
        '{"type": ["offer"]}',
        " " * (LONGEST_LINE + 1),
    ],
)
def test_a_line_that_is_made_to_do_harm_is_explained(line: str) -> None:
    with pytest.raises(ValueError, match=r"it|this"):
        parse(line)


def test_more_than_a_person_pastes_is_left_out():
    async def paste() -> tuple[int, int]:
        source, keys = os.pipe()
        signaling = CopyPasteSignaling("the other terminal", source, io.StringIO())
        await signaling.connect()
        lines = signaling._lines

        def write() -> None:
            os.write(keys, b"{" * (1 << 16))
            for _ in range(64):
                os.write(keys, b"x" * (1 << 16))
            os.write(keys, b"\n{}" * 5000 + b"\n")
            os.close(keys)

        await asyncio.to_thread(write)
        while not lines.qsize() or lines._queue[-1] is not None:
            await asyncio.sleep(0.01)
        os.close(source)
        return lines.qsize(), max(len(each) for each in lines._queue if each is not None)

    count, longest = asyncio.run(asyncio.wait_for(paste(), DEADLINE))
    assert count == MOST_LINES + 1 and longest == LONGEST_LINE + 1
