"""WebRTC signaling by hand: a person copies lines between two terminals. The lines are as in aiortc's copy and paste.

    {"sdp": "…", "type": "offer" or "answer"}                                       a session description
    {"candidate": "candidate:…", "id": "0", "label": 0, "type": "candidate"}        one more address (ICE)
    {"type": "bye"}                                                                 the other side ends

A person takes a minute and makes mistakes, so nothing here has a time limit, and a line that is of no use is explained
and asked for again.

No key is needed: who the other end is, the person knows who carries the lines, and the lines hold the fingerprints of
both certificates. So they must go a way on which nobody changes them, such as between two terminals of one screen or
over ssh; who reads them can do nothing with them. What is pasted is read within bounds all the same.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import sys
import threading
from typing import TextIO

from aiortc import RTCIceCandidate, RTCPeerConnection, RTCSessionDescription
from aiortc.contrib.signaling import BYE, BaseSignaling, SignalingBye, object_from_string, object_to_string

from telepresence.video.foreign_sdp import MAX_CANDIDATES, checked

Message = RTCSessionDescription | RTCIceCandidate | SignalingBye
SEND_PROMPT = "-- Please send this message to the remote party --"
RECEIVE_PROMPT = "-- Please enter a message from remote party --"
EXITING = "Exiting.."
"""The words that the Robotino guide's reader looks for."""
TERMINAL_LINE = 4095
"""Characters of a line that a Linux terminal takes; the rest is dropped without a word."""
LONGEST_LINE = 64 * 1024
"""Bytes of a line that is pasted; a longer one is of no use."""
MOST_LINES = 100
"""Lines that wait to be looked at; more are left out."""
NO_CONNECTION_YET = 10.0
"""Seconds after both descriptions are known, after which a missing connection is explained."""


class InputEnded(ValueError):
    """Standard input has ended, so nothing can be pasted any more."""


class CopyPasteSignaling(BaseSignaling):
    """One terminal of the two.

    Args:
        remote: What runs in the other terminal, for a person to read.
        source: File descriptor that lines are pasted into.
        output: Where the lines to be copied and the explanations go.
    """

    def __init__(self, remote: str, source: int = 0, output: TextIO | None = None) -> None:
        self._remote = remote
        self._source = source
        self._output = sys.stdout if output is None else output
        self._lines: asyncio.Queue[str | None] | None = None

    async def connect(self) -> None:
        """Begin to read; more than once is harmless."""
        if self._lines is None:
            self._lines = asyncio.Queue()
            # A thread, because the event loop cannot wait for files and would make the terminal non-blocking for all.
            arguments = (asyncio.get_running_loop(), self._lines)
            threading.Thread(target=self._read, args=arguments, name="pasted lines", daemon=True).start()

    async def close(self) -> None:
        """Print the line that ends the other side."""
        if self._lines is not None:
            self._lines = None
            self._print(object_to_string(BYE))

    async def send(self, descr: Message) -> None:
        """Print a message as one line, and where to carry it."""
        self._print(f"{SEND_PROMPT}\n   Copy the next line, from {{ to }}, into {self._remote}:\n")
        self._print(object_to_string(descr) + "\n")

    async def receive(self) -> Message:
        """Return the next message that can be read; others are explained.

        Raises:
            InputEnded: There will be none.
        """
        assert self._lines is not None, "connect comes first"
        while True:
            line = await self._lines.get()
            if line is None:
                self._lines.put_nowait(None)  # for whoever reads next
                raise InputEnded("standard input has ended; run this in a terminal and paste the lines there")
            line = line.strip()
            if not line or line.startswith("--"):  # a prompt that was copied along with its line
                continue
            try:
                return parse(line)
            except ValueError as error:
                self.explain(str(error))

    def ask(self, what: str) -> None:
        """Print what is to be pasted here."""
        self._print(f"{RECEIVE_PROMPT}\n   Paste here {what}, then press Enter. There is no hurry.\n")

    def explain(self, why: str) -> None:
        """Print why a line was of no use."""
        self._print(f"   Not taken: {why}. Try again: paste another line here.\n")

    def say(self, text: str) -> None:
        """Print how things stand."""
        self._print(f"   {text}")

    def _print(self, text: str) -> None:
        print(text, file=self._output, flush=True)

    def _read(self, loop: asyncio.AbstractEventLoop, lines: asyncio.Queue[str | None]) -> None:
        """Hand over every line, then None."""
        rest = b""
        with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
            while data := self._read_some():
                *whole, rest = (rest + data).split(b"\n")
                rest = rest[: LONGEST_LINE + 1]
                for line in whole:
                    loop.call_soon_threadsafe(_queue, lines, line)
            if rest:
                loop.call_soon_threadsafe(_queue, lines, rest)
            loop.call_soon_threadsafe(lines.put_nowait, None)

    def _read_some(self) -> bytes:
        try:
            return os.read(self._source, 1 << 16)
        except OSError:  # a terminal that was closed, or none for a program in the background
            return b""


def _queue(lines: asyncio.Queue[str | None], line: bytes) -> None:
    if lines.qsize() < MOST_LINES:
        lines.put_nowait(line[: LONGEST_LINE + 1].decode(errors="replace"))


def parse(line: str) -> Message:
    """Return what a pasted line says.

    Raises:
        ValueError: It says nothing; the text explains that to whoever pasted it.
    """
    if len(line) > LONGEST_LINE:
        raise ValueError(f"it is longer than {LONGEST_LINE} characters")
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):
        if len(line) >= TERMINAL_LINE:
            reason = f"it was cut: a terminal takes no line longer than {TERMINAL_LINE} characters; start both sides "
            raise ValueError(reason + "with one address (--address, _address:=), which makes it shorter") from None
        raise ValueError("it is not one whole line from { to }") from None
    kind = content.get("type") if isinstance(content, dict) else None
    if kind not in ("offer", "answer", "candidate", "bye"):
        raise ValueError("it is neither offer, answer, candidate nor bye")
    try:
        if kind == "candidate":  # browsers name these two differently
            content = {"id": content.get("sdpMid"), "label": content.get("sdpMLineIndex"), **content}
        message = object_from_string(json.dumps(content))
        if isinstance(message, RTCSessionDescription):
            checked(message.sdp)
        return message
    except Exception as error:  # aiortc parses with asserts and indices
        raise ValueError(f"this {kind} cannot be understood ({error!r})") from None


async def take_description(
    signaling: CopyPasteSignaling,
    peer: RTCPeerConnection,
    kind: str,
    pasted: list[RTCSessionDescription] | None = None,
) -> bool:
    """Read lines until one is the other side's description; False when the other side says goodbye instead.

    Candidates that come before it are added after it.

    Args:
        kind: "offer" or "answer".
        pasted: Tried before anything is read, and emptied.
    Raises:
        InputEnded: It never came.
    """
    early: list[RTCIceCandidate] = []
    while True:
        message: Message = pasted.pop() if pasted else await signaling.receive()
        if isinstance(message, SignalingBye):
            return False
        if isinstance(message, RTCIceCandidate):
            if len(early) < MAX_CANDIDATES:
                early.append(message)
        elif await _set_description(signaling, peer, kind, message):
            break
    for candidate in early:
        await _add_candidate(signaling, peer, candidate)
    return True


async def follow(signaling: CopyPasteSignaling, peer: RTCPeerConnection, kind: str) -> Message:
    """Add the candidates that are pasted, until a goodbye or the begin of another exchange, which is returned.

    Args:
        kind: The description that begins another exchange: a receiver takes a new offer at any time, a sender that is
            not connected makes one when an answer comes.
    """
    while True:
        try:
            message = await signaling.receive()
        except InputEnded:
            await asyncio.Event().wait()  # the pictures go on; only nothing more can be pasted
            raise
        if isinstance(message, RTCIceCandidate):
            await _add_candidate(signaling, peer, message)
        elif isinstance(message, SignalingBye):
            return message
        elif message.type == kind and (kind == "offer" or peer.connectionState != "connected"):
            return message
        else:
            signaling.explain(f"an {message.type} is of no use now")


async def connected(signaling: CopyPasteSignaling, peer: RTCPeerConnection) -> bool:
    """Wait for the connection, and say how it goes; False if it failed."""
    loop = asyncio.get_running_loop()
    remind_at = loop.time() + NO_CONNECTION_YET
    while peer.connectionState in ("new", "connecting"):
        await asyncio.sleep(0.1)
        if loop.time() > remind_at:
            remind_at = loop.time() + 6 * NO_CONNECTION_YET
            signaling.say(
                "No connection yet. If both lines were pasted: does each machine reach the other's address? Lines with "
                "further candidates can be pasted here."
            )
    if peer.connectionState == "connected":
        signaling.say("Connected. Ctrl-C ends both sides.")
        return True
    return False


async def _set_description(
    signaling: CopyPasteSignaling, peer: RTCPeerConnection, kind: str, message: RTCSessionDescription
) -> bool:
    own = peer.localDescription
    if own is not None and message.sdp == own.sdp:
        signaling.explain("this is the line that this program printed itself")
    elif message.type != kind:
        signaling.explain(f"this is an {message.type}, and an {kind} is needed")
    else:
        # Without that line candidates may follow, and a connection that takes its time is not given up.
        sdp = re.sub(r"^a=end-of-candidates\r?\n", "", message.sdp, flags=re.MULTILINE)
        try:
            await peer.setRemoteDescription(RTCSessionDescription(sdp, kind))
            return True
        except Exception as error:  # aiortc parses with asserts and indices
            signaling.explain(f"this {kind} cannot be understood ({error!r})")
    return False


async def _add_candidate(signaling: CopyPasteSignaling, peer: RTCPeerConnection, candidate: RTCIceCandidate) -> None:
    if candidate.sdpMLineIndex != 0 and candidate.sdpMid not in {each.mid for each in peer.getTransceivers()}:
        signaling.explain("this candidate belongs to no picture of this exchange")
        return
    try:
        await peer.addIceCandidate(candidate)
    except Exception as error:  # of aioice: a protocol or an address that it does not know
        signaling.explain(f"this candidate cannot be used ({error!r})")
    else:
        address = candidate.ip if candidate.ip.isprintable() else repr(candidate.ip)
        signaling.say(f"Candidate taken: {address}, port {candidate.port}.")
