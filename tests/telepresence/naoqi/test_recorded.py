"""Conversations recorded with qi 3.1.5, played byte for byte to either library's server by a socket.

The services have the numbers that they had in the recording (tests/lab/naoqi_services.py, `Recorded`). Columns of the
table say where libqi's own server of today does something else than an older one did.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

import pytest
from naoqi_bytes import (
    CALL,
    CANCEL,
    CANCELED,
    CAPABILITIES,
    CAPABILITY,
    ERROR,
    EVENT,
    LOGIN,
    POST,
    REPLY,
    Closed,
    Message,
    RawPeer,
    dynamic,
    flags,
    text,
)  # fmt: skip
from naoqi_services import OURS, VENDOR, ServerProcess


@pytest.fixture(
    scope="module",
    params=[pytest.param(VENDOR, id="libqi", marks=pytest.mark.vendor), pytest.param(OURS, id="ours")],
)
def server(request: pytest.FixtureRequest) -> Iterator[ServerProcess]:
    with ServerProcess(request.param) as running:
        yield running


@pytest.fixture
def peer(server: ServerProcess) -> Iterator[RawPeer]:
    with RawPeer(("127.0.0.1", server.port)) as connection:
        yield connection


@pytest.fixture
def client(peer: RawPeer) -> RawPeer:
    peer.log_in()
    return peer


def octets(words: str) -> bytes:
    return bytes.fromhex(words.replace("|", ""))


HEAD = "42dead42"


class Exchange(NamedTuple):
    name: str
    sent: str
    answered: str


EXCHANGES = [
    Exchange(
        "add(1, 2)",
        f"{HEAD} 0b000000 08000000 0000 01 00 02000000 01000000 64000000 | 01000000 02000000",
        f"{HEAD} 0b000000 04000000 0000 02 00 02000000 01000000 64000000 | 03000000",
    ),
    Exchange(
        "bytes after the arguments",
        f"{HEAD} 0b000000 0b000000 0000 01 00 02000000 01000000 64000000 | 01000000 02000000 ffffff",
        f"{HEAD} 0b000000 04000000 0000 02 00 02000000 01000000 64000000 | 03000000",
    ),
    Exchange(
        "add(1, 2) as one dynamic",
        f"{HEAD} 0c000000 18000000 0000 01 01 02000000 01000000 64000000"
        "| 04000000 28 6d6d 29 01000000 69 01000000 01000000 69 02000000".replace("18000000", "1a000000"),
        f"{HEAD} 0c000000 04000000 0000 02 00 02000000 01000000 64000000 | 03000000",
    ),
    Exchange(
        "add(1, 2) with a double wanted",
        f"{HEAD} 0d000000 0d000000 0000 01 02 02000000 01000000 64000000 | 01000000 02000000 01000000 64",
        f"{HEAD} 0d000000 0d000000 0000 02 01 02000000 01000000 64000000 | 01000000 64 0000000000000840",
    ),
    Exchange(
        "the directory asked for Nope",
        f"{HEAD} 0a000000 08000000 0000 01 00 01000000 01000000 64000000 | 04000000 4e6f7065",
        f"{HEAD} 0a000000 2c000000 0000 03 00 01000000 01000000 64000000 | 01000000 73 23000000"
        + b"Cannot find service 'Nope' in index".hex(),
    ),
    Exchange(
        "echo of a dynamic",
        f"{HEAD} 0e000000 0d000000 0000 01 00 02000000 01000000 71000000 | 01000000 6c 0500000000000000",
        f"{HEAD} 0e000000 0d000000 0000 02 00 02000000 01000000 71000000 | 01000000 6c 0500000000000000",
    ),
    Exchange(
        "setProperty(114, 2.5)",
        f"{HEAD} 0f000000 16000000 0000 01 00 02000000 01000000 06000000"
        "| 01000000 49 72000000 01000000 64 0000000000000440",
        f"{HEAD} 0f000000 00000000 0000 02 00 02000000 01000000 06000000",
    ),
    Exchange(
        "property(114)",
        f"{HEAD} 10000000 09000000 0000 01 00 02000000 01000000 05000000 | 01000000 49 72000000",
        f"{HEAD} 10000000 09000000 0000 02 00 02000000 01000000 05000000 | 01000000 66 00002040",
    ),
    Exchange(
        "property of no such name",
        f"{HEAD} 11000000 0b000000 0000 01 00 02000000 01000000 05000000 | 01000000 73 02000000 7a7a",
        f"{HEAD} 11000000 26000000 0000 03 00 02000000 01000000 05000000 | 01000000 73 1d000000"
        + b'property "zz" was not found'.hex(),
    ),
]
KNOWN_LENGTHS = {"property of no such name"}
"""Rows whose lengths are filled in from their text."""


def with_lengths(message: bytes) -> bytes:
    """The message with the lengths of an error's text as they are."""
    payload = message[28:]
    body = payload[:5] + struct.pack("<I", len(payload) - 9) + payload[9:]
    return message[:8] + struct.pack("<I", len(body)) + message[12:28] + body


@pytest.mark.parametrize("row", EXCHANGES, ids=lambda row: row.name)
def test_a_recorded_exchange(client: RawPeer, row: Exchange) -> None:
    """The answer is the recorded one, byte for byte."""
    expected = octets(row.answered)
    if row.name in KNOWN_LENGTHS:
        expected = with_lengths(expected)
    if row.name == "property(114)":
        client.answer(octets(EXCHANGES[6].sent))
    assert client.answer(octets(row.sent)).pack() == expected


def test_the_first_message_is_the_recorded_one() -> None:
    begin = f"{HEAD} 02000000 a1000000 0000 01 00 00000000 00000000 08000000 | 06000000 12000000"
    assert LOGIN.pack().startswith(octets(begin) + b"ClientServerSocket\x01\0\0\0b\x01") and len(LOGIN.payload) == 0xA1


def test_the_login_of_today(peer: RawPeer) -> None:
    answer = peer.log_in()
    assert answer[:4] == (REPLY, 0, 0, 8) and answer.identity == 2
    assert b"\x0f\0\0\0__qi_auth_state\x01\0\0\0I\x03\0\0\0" in answer.payload
    for key, _ in CAPABILITIES:
        assert key.encode() in answer.payload


def test_the_login_with_an_empty_map_and_a_second_one(peer: RawPeer) -> None:
    empty = Message(CALL, 0, 0, 8, bytes(4))
    assert peer.answer(empty).kind == REPLY
    again = peer.answer(empty)
    assert again.payload == octets("01000000 0f000000") + b"__qi_auth_state" + octets("01000000 49 03000000")


def test_a_client_that_knows_no_login(peer: RawPeer) -> None:
    """As NAOqi 2.1's clients did: capabilities, then calls to service 0 only count as a login."""
    peer.send(Message(CAPABILITY, 0, 0, 0, flags(("ClientServerSocket", True), ("MetaObjectCache", True))))
    refused = peer.answer(Message(CALL, 1, 1, 2, bytes(4)))
    assert refused.kind == ERROR and b"The call request could not be handled." in refused.payload
    told = peer.answer(Message(CALL, 0, 0, 3, identity=50), CAPABILITY)
    assert b"ClientServerSocket" in told.payload
    assert peer.answer(Message(CALL, 1, 1, 108, identity=51)).kind == REPLY


def test_an_event_registered_and_unregistered(client: RawPeer) -> None:
    link = octets("02000000 73000000 0d00000073000000")
    answer = client.answer(Message(CALL, 2, 1, 0, link, identity=4))
    assert answer.kind == REPLY and len(answer.payload) == 8
    client.send(Message(POST, 2, 1, 118, struct.pack("<i", 3) + text("hey")))
    event = client.next(EVENT)
    assert event.pack()[8:] == octets("0b000000 0000 05 00 02000000 01000000 73000000 | 03000000 03000000 686579")
    assert client.answer(Message(CALL, 2, 1, 1, link)).kind == REPLY
    unknown = client.answer(Message(CALL, 2, 1, 1, link))
    assert unknown.kind == ERROR and b"Unregister request failed" in unknown.payload


def test_an_event_that_a_client_posts(client: RawPeer) -> None:
    client.answer(Message(CALL, 2, 1, 0, octets("02000000 73000000 0d00000073000000")))
    client.send(Message(POST, 2, 1, 115, struct.pack("<i", 3) + text("hey")))
    assert client.next(EVENT).payload == octets("03000000 03000000 686579")


def test_events_are_converted_to_the_signature_that_was_asked_for(client: RawPeer) -> None:
    request = octets("02000000 72000000 0d00000072000000") + text("(d)")
    assert client.answer(Message(CALL, 2, 1, 8, request)).kind == REPLY
    client.send(octets(EXCHANGES[6].sent))
    event = client.next(EVENT)
    assert event.flags == 1 and event.payload == dynamic("(d)", struct.pack("<d", 2.5))


def test_a_call_is_cancelled(client: RawPeer) -> None:
    client.send(octets(f"{HEAD} 28000000 00000000 0000 01 00 02000000 01000000 75000000"))
    cancel = octets(f"{HEAD} 29000000 04000000 0000 07 00 02000000 01000000 00000000 | 28000000")
    answer = client.answer(cancel)
    assert answer.pack() == octets(f"{HEAD} 28000000 00000000 0000 08 00 02000000 01000000 75000000")
    client.send(Message(CANCEL, 2, 1, 0, struct.pack("<I", 12345)))  # nobody's call: silence
    assert client.answer(Message(CALL, 2, 1, 100, bytes(8))).kind == REPLY


def test_a_client_cancels_that_has_not_announced_that_it_can(peer: RawPeer) -> None:
    """The call ends: by CANCELED, as libqi answers, or by an error, which such a client knows."""
    assert peer.answer(Message(CALL, 0, 0, 8, flags(("ClientServerSocket", True)))).kind == REPLY
    peer.send(Message(CALL, 2, 1, 117, identity=0x28))
    answer = peer.answer(Message(CANCEL, 2, 1, 0, struct.pack("<I", 0x28)))
    assert answer.kind in (ERROR, CANCELED) and answer.identity == 0x28


class Refusal(NamedTuple):
    name: str
    message: Message
    text: bytes


REFUSALS = [
    Refusal("no such action", Message(CALL, 2, 1, 999, identity=5), b"No such method {2.1.999, id:5}"),
    Refusal("no such service", Message(CALL, 77, 1, 100), b"The call request could not be handled."),
    Refusal("no such object", Message(CALL, 2, 9, 100), b"The call request could not be handled."),
    Refusal("too few bytes", Message(CALL, 2, 1, 100, bytes(4)), b""),
    Refusal("another version", Message(CALL, 2, 1, 100, bytes(8), version=1), b"binary protocol v1"),
    Refusal("a text for a number", Message(CALL, 2, 1, 100, dynamic("(sm)", text("x") * 2), flags=1), b""),
]


@pytest.mark.parametrize("row", REFUSALS, ids=lambda row: row.name)
def test_a_call_is_refused_and_the_connection_lives(client: RawPeer, row: Refusal) -> None:
    answer = client.answer(row.message)
    assert answer.kind == ERROR and answer.payload.startswith(b"\x01\0\0\0s") and row.text in answer.payload
    assert client.answer(Message(CALL, 2, 1, 100, bytes(8))).kind == REPLY


@pytest.mark.parametrize("kind", [0, 9, 255])
def test_a_message_of_no_known_type_is_passed_over(client: RawPeer, kind: int) -> None:
    client.send(Message(kind, 2, 1, 100, bytes(8)))
    assert client.answer(Message(CALL, 2, 1, 100, bytes(8))).kind == REPLY


def test_bytes_one_at_a_time(client: RawPeer) -> None:
    for octet in octets(EXCHANGES[0].sent):
        client.send(bytes([octet]))
    assert client.next().pack() == octets(EXCHANGES[0].answered)


def test_a_wrong_magic_ends_the_connection(client: RawPeer) -> None:
    client.send(b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n")
    with pytest.raises((Closed, ConnectionError)):
        client.receive()


def test_the_services_are_listed_with_their_annotation(client: RawPeer) -> None:
    """Without the field names a C++ client of another version refuses the directory."""
    described = client.answer(Message(CALL, 1, 1, 2, bytes(4))).payload
    assert b"<ServiceInfo,name,serviceId,machineId,processId,endpoints,sessionId" in described
    info = client.answer(Message(CALL, 1, 1, 100, text("Recorded"))).payload
    assert info.startswith(text("Recorded") + struct.pack("<I", 2))
