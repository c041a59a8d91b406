"""Headers byte for byte, and messages that arrive in pieces of any size."""

import random
import tracemalloc

import pytest

from telepresence.naoqi import message
from telepresence.naoqi.message import Header, MessageReader
from telepresence.naoqi.signature import WireError

RECORDED = [
    ("42dead42 0b000000 08000000 0000 01 00 02000000 01000000 64000000", Header(11, 8, message.CALL, 0, 2, 1, 100)),
    ("42dead42 0b000000 04000000 0000 02 00 02000000 01000000 64000000", Header(11, 4, message.REPLY, 0, 2, 1, 100)),
    ("42dead42 0a000000 2c000000 0000 03 00 01000000 01000000 64000000", Header(10, 44, message.ERROR, 0, 1, 1, 100)),
    ("42dead42 04000000 10000000 0000 01 00 01000000 01000000 00000000", Header(4, 16, message.CALL, 0, 1, 1, 0)),
    ("42dead42 1a000000 0b000000 0000 05 00 02000000 01000000 73000000", Header(26, 11, message.EVENT, 0, 2, 1, 115)),
    ("42dead42 29000000 04000000 0000 07 00 02000000 01000000 00000000", Header(41, 4, message.CANCEL, 0, 2, 1, 0)),
    ("42dead42 28000000 00000000 0000 08 00 02000000 01000000 75000000", Header(40, 0, message.CANCELED, 0, 2, 1, 117)),
    ("42dead42 25000000 04000000 0000 04 00 02000000 03000000 03000000", Header(37, 4, message.POST, 0, 2, 3, 3)),
    ("42dead42 02000000 a1000000 0000 01 00 00000000 00000000 08000000", Header(2, 161, message.CALL, 0, 0, 0, 8)),
]
"""Between qi 3.1.5 and itself."""


@pytest.mark.parametrize(("recorded", "header"), RECORDED)
def test_headers_are_those_that_were_recorded(recorded, header):
    data = bytes.fromhex(recorded)
    assert header.pack() == data
    assert Header.unpack(data) == header


def test_flags_version_and_kind_are_the_receivers_matter():
    header = Header(1, 0, 9, message.DYNAMIC_PAYLOAD | message.RETURN_TYPE, 1, 1, 1, version=1)
    assert Header.unpack(header.pack()) == header


@pytest.mark.parametrize("data", [b"", b"\x42\xde\xad\x42", b"GET / HTTP/1.1\r\nHost: pepper\r\n\r\n"])
def test_what_is_no_header_is_refused(data):
    with pytest.raises(WireError, match=r"header|NAOqi"):
        Header.unpack(data)


def test_a_field_out_of_range_is_refused():
    with pytest.raises(WireError, match="does not fit"):
        Header(1, 0, 1, 0, -1, 1, 1).pack()


def _messages():
    payloads = [b"", b"\3\0\0\0", bytes(range(256)) * 3, b"long" * 30_000, b"", b"edge" * 4096, b"x"]
    made = [(Header(n, len(p), message.CALL, 0, 2, 1, 100), p) for n, p in enumerate(payloads)]
    return made, b"".join([header.pack() + payload for header, payload in made])


@pytest.mark.parametrize("most", [1, 27, 28, 29, 1000, 65536, 1_000_000])
def test_messages_arrive_in_pieces_of_any_size(most):
    made, data = _messages()
    reader, got, at = MessageReader(), [], 0
    while at < len(data):
        got += reader.feed(data[at : at + most])
        at += most
    assert got == made and reader.idle


def test_messages_arrive_in_pieces_of_all_sizes_from_one_buffer():
    made, data = _messages()
    stream, scratch = memoryview(data), bytearray(4000)
    reader, got, at = MessageReader(), [], 0
    sizes = random.Random(1)
    while at < len(data):
        size = min(len(data) - at, sizes.randrange(1, 4000))
        scratch[:size] = stream[at : at + size]
        at += size
        got += reader.feed(memoryview(scratch)[:size])
    assert got == made and reader.idle


def test_the_messages_before_a_bad_one_arrive():
    good = Header(1, 2, message.POST, 0, 1, 1, 1).pack() + b"ok"
    arriving = MessageReader().feed(good + b"\0" * 28)
    assert next(arriving)[1] == b"ok"
    with pytest.raises(WireError, match="00 00 00 00"):
        next(arriving)


def test_a_payload_beyond_the_limit_is_refused_by_its_header():
    header = Header(1, 0xFFFFFFFF, message.CALL, 0, 1, 1, 1).pack()
    with pytest.raises(WireError, match="4294967295 bytes"):
        list(MessageReader(1000).feed(header))
    for size in range(1, 28):
        reader = MessageReader(1000)
        assert not list(reader.feed(header[:size]))
        with pytest.raises(WireError, match="1000 are allowed"):
            list(reader.feed(header[size:]))


def test_a_length_that_lies_allocates_no_more_than_arrives():
    header = Header(1, 60 << 20, message.CALL, 0, 1, 1, 1).pack()
    tracemalloc.start()
    try:
        reader = MessageReader()
        assert not list(reader.feed(header + bytes(1000)))
        for _ in range(20):
            assert not list(reader.feed(bytes(1000))) and not reader.idle
        assert tracemalloc.get_traced_memory()[1] < 100_000
    finally:
        tracemalloc.stop()
