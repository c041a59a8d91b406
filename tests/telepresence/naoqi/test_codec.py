"""Values on the wire: byte for byte as recorded, read back as they were, and nonsense refused."""

import random
import struct
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest

from telepresence.naoqi import codec
from telepresence.naoqi.codec import (
    decode,
    decode_arguments,
    decode_from,
    encode,
    encode_arguments,
    encode_dynamic,
    encode_dynamic_arguments,
)
from telepresence.naoqi.dynamics import PYTHON, ROBOT, Record, Typed, signature_of
from telepresence.naoqi.message import DYNAMIC_PAYLOAD
from telepresence.naoqi.signature import WireError


def _bytes(buffers):
    return b"".join(map(bytes, buffers))


RECORDED = [
    ("01000000 02000000", lambda: encode_arguments("(ii)", (1, 2)), "(ii)", (1, 2)),
    ("03000000", lambda: encode("i", 3), "i", 3),
    (
        "01000000 73 23000000" + b"Cannot find service 'Nope' in index".hex(),
        lambda: encode_dynamic("Cannot find service 'Nope' in index"),
        "m",
        "Cannot find service 'Nope' in index",
    ),
    (
        "01000000 6a000000 0d0000006a000000",
        lambda: encode_arguments("(IIL)", (1, 106, 106 << 32 | 13)),
        "(IIL)",
        (1, 106, 106 << 32 | 13),
    ),
    ("0e0000006a000000", lambda: encode("L", 106 << 32 | 14), "L", 106 << 32 | 14),
    ("03000000 03000000 686579", lambda: encode("(is)", (3, "hey")), "(is)", (3, "hey")),
    ("01000000 49 72000000", lambda: encode_dynamic(Typed("I", 114)), "m", 114),
    ("01000000 66 00000000", lambda: encode_dynamic(0.0, dialect=ROBOT), "m", 0.0),
    (
        "01000000 49 72000000 01000000 64 0000000000000440",
        lambda: encode_arguments("(mm)", (Typed("I", 114), 2.5)),
        "(mm)",
        (114, 2.5),
    ),
    ("28000000", lambda: encode("I", 40), "I", 40),
    ("01000000 6c 0500000000000000", lambda: encode("m", 5), "m", 5),
    (
        "03000000 5b6d5d 03000000 01000000 6c 0100000000000000 01000000 64 0000000000000440 01000000 73 01000000 78",
        lambda: encode("m", [1, 2.5, "x"]),
        "m",
        [1, 2.5, "x"],
    ),
    (
        "03000000 286d29 01000000 6c 0000000000010000",
        lambda: encode_dynamic_arguments((1 << 40,)),
        "m",
        (1 << 40,),
    ),
    ("01000000 64 0000000000000840", lambda: encode_dynamic(3.0), "m", 3.0),
    (
        "12000000" + b"ClientServerSocket".hex() + "01000000 62 01",
        lambda: encode("(sm)", ("ClientServerSocket", True)),
        "(sm)",
        ("ClientServerSocket", True),
    ),
    ("01000000 76", lambda: encode("m", None), "m", None),
    ("01000000 6d 01000000 73 01000000 78", lambda: encode_dynamic(Typed("m", "x")), "m", "x"),
]
"""Between qi 3.1.5 and itself."""


@pytest.mark.parametrize(("recorded", "written", "signature", "value"), RECORDED)
def test_values_are_written_and_read_as_recorded(recorded, written, signature, value):
    data = bytes.fromhex(recorded)
    assert _bytes(written()) == data
    assert decode_from(signature, data) == (value, len(data))
    assert decode(signature, bytearray(data)) == decode(signature, memoryview(data + b"more")) == value


@pytest.mark.parametrize(
    ("signature", "value"),
    [
        ("v", None),
        ("b", True),
        ("c", -128),
        ("C", 255),
        ("w", -(2**15)),
        ("W", 2**16 - 1),
        ("i", -5),
        ("I", 2**32 - 1),
        ("l", -(2**63)),
        ("L", 2**64 - 1),
        ("f", 0.5),
        ("d", 0.1),
        ("s", "häh \u2603"),
        ("s", b"\xff\xfe not UTF-8"),
        ("s<uid>", b"\x90\xbf\x6a"),
        ("r", b"\x00\xff"),
        ("r", b"picture" * 10_000),
        ("[s]", ["a", ""]),
        ("[b]", [True, False]),
        ("[f]", [0.5, -2.0]),
        ("[c]", []),
        ("[[i]]", [[1], [], [2, 3]]),
        ("{sI}", {"a": 1, "b": 2}),
        ("{r(ss)}", {b"key": ("a", "b")}),
        ("{mm}", {"a": 1, 2: "b", None: 0.5}),
        ("(is[f])", (1, "x", [0.5, -2.0])),
        ("(if)<P,x,y>", {"x": 1, "y": 2.0}),
        ("(is)<P,x,y>", {"x": 1, "y": "2"}),
        ("(if)<P,x,x>", (1, 2.0)),
        ("()", ()),
        ("+i", None),
        ("+[s]", ["a"]),
        ("#m", [1, "a"]),
        ("~m", []),
        ("[m]", [1, "a", None, True, [2, [0.5]], b"\xff", (1, "x"), {"k": [1]}]),
        ("[m]", [1.5] * 500),
        ("[m]", list(range(-250, 250))),
        ("[m]", [f"key{n}" for n in range(500)] + ["long" * 100]),
        ("[m]", [1, 2, 3, 2**64 - 1, -(2**63)]),
        ("[m]", [1.5, 2.5, 3.5, None, 1e300, 1]),
        ("[v]", [None] * 1000),
        ("m", {"a": 1}),
        ("m", [[[]]]),
    ],
)
@pytest.mark.parametrize("dialect", [PYTHON, ROBOT], ids=["python", "robot"])
def test_values_survive(signature, value, dialect):
    data = _bytes(encode(signature, value, dialect=dialect))
    got, end = decode_from(signature, b"before" + data, 6)
    assert end == 6 + len(data)
    if dialect is ROBOT and value == [1, "a", None, True, [2, [0.5]], b"\xff", (1, "x"), {"k": [1]}]:
        value[6] = [1, "x"]
    assert got == value
    if isinstance(value, dict) and "<" in signature:
        assert got.x == 1 and isinstance(got, Record)


@pytest.mark.parametrize(
    ("value", "python", "robot"),
    [
        (1, "l", "i"),
        (2**31, "l", "l"),
        (2**63, "L", "L"),
        (True, "b", "b"),
        (0.5, "d", "f"),
        ("a", "s", "s"),
        (b"a", "r", "r"),
        (bytearray(b"a"), "r", "r"),
        (memoryview(b"a"), "r", "r"),
        (np.zeros(2), "r", "r"),
        (np.int16(1), "l", "i"),
        (np.float32(1), "d", "f"),
        (np.True_, "b", "b"),
        ([1], "[m]", "[m]"),
        ((1, 2), "(mm)", "[m]"),
        ({1}, "(m)", "[m]"),
        ({1: 2}, "{mm}", "{mm}"),
        (Record(a=1), "{mm}", "{mm}"),
        (None, "v", "v"),
        (Typed("[f]", [1]), "[f]", "[f]"),
        (Typed("w", 1.9), "w", "w"),
    ],
)
def test_dynamics_have_the_senders_types(value, python, robot):
    for dialect, signature in ((PYTHON, python), (ROBOT, robot)):
        data = _bytes(encode("m", value, dialect=dialect))
        assert data[4 : 4 + data[0]].decode() == signature == signature_of(value, dialect)


def test_a_lists_numbers_get_the_type_that_each_needs():
    assert _bytes(encode("[m]", [1, 2, 3, 2**31], dialect=ROBOT)) == struct.pack(
        "<I" + "IBi" * 3 + "IBq", 4, 1, 105, 1, 1, 105, 2, 1, 105, 3, 1, 108, 2**31
    )
    data = _bytes(encode("[m]", [0.5] * 3 + [1e300], dialect=ROBOT))
    assert data == struct.pack("<I" + "IBf" * 3 + "IBd", 4, 1, 102, 0.5, 1, 102, 0.5, 1, 102, 0.5, 1, 100, 1e300)
    for items in (list(range(7)), [0.5] * 7, ["a"] * 7, [1, 0.5, "a", None] * 3):
        one_by_one = b"".join([_bytes(encode("m", item)) for item in items])
        assert _bytes(encode("[m]", items)) == struct.pack("<I", len(items)) + one_by_one
        assert decode("[m]", struct.pack("<I", len(items)) + one_by_one) == items


@pytest.mark.parametrize(
    ("signature", "value", "same"),
    [
        ("i", 2.9, 2),
        ("(if)", [True, 1], (1, 1.0)),
        ("(ii)<P,x,y>", {"y": 2, "x": 1}, (1, 2)),
        ("[i]", np.arange(3), [0, 1, 2]),
        ("[f]", np.arange(3, dtype=np.float32), [0.0, 1.0, 2.0]),
        ("[C]", np.arange(3, dtype=np.uint8), [0, 1, 2]),
        ("[m]", np.arange(3), [0, 1, 2]),
        ("r", "text", b"text"),
        ("r", np.arange(3, dtype=np.uint8)[::2], b"\0\2"),
        ("r", np.zeros((0, 3)), b""),
        ("r", np.array([1], ">u2"), b"\0\1"),
        ("s", bytearray(b"a"), "a"),
        ("[s]", ("a", "b"), ["a", "b"]),
        ("i", Typed("f", 2), 2),
        ("m", Typed("(ii)<P,x,y>", {"x": 1, "y": 2.5}), Typed("(ii)", (1, 2))),
    ],
)
def test_values_are_converted_to_what_is_declared(signature, value, same):
    data, expected = _bytes(encode(signature, value)), _bytes(encode(signature, same))
    assert data.replace(b"\x0b\0\0\0(ii)<P,x,y>", b"\4\0\0\0(ii)") == expected


@pytest.mark.parametrize("value", [np.zeros((480, 640, 3), np.uint8), bytearray(5000), memoryview(bytes(5000))])
@pytest.mark.parametrize("signature", ["[m]", "([r])"])
def test_pictures_are_not_copied_on_the_way_out(signature, value):
    buffers = encode(signature, [1, value, 2] if signature == "[m]" else ([value],))
    assert any(np.shares_memory(np.asarray(part), np.asarray(value)) for part in buffers if type(part) is memoryview)
    assert decode(signature, _bytes(buffers)) == ([1, bytes(value), 2] if signature == "[m]" else ([bytes(value)],))


def test_pictures_are_copied_once_on_the_way_in():
    payload = _bytes(encode("[m]", [1, bytes(4 << 20)]))
    tracemalloc.start()
    try:
        picture = decode("[m]", payload)[1]
        assert tracemalloc.get_traced_memory()[1] < 5 << 20
    finally:
        tracemalloc.stop()
    picture[0] = 1  # as the vendor's: np.frombuffer(picture) can be drawn into
    assert len(picture) == 4 << 20


class _References:
    """Objects by number."""

    def __init__(self):
        self.given = []

    def write(self, value):
        if not isinstance(value, list):
            raise WireError("no object")
        self.given.append(value)
        return struct.pack("<I", value[0])

    def read(self, payload, offset):
        return [struct.unpack_from("<I", payload, offset)[0]], offset + 4


class _Thing:
    pass


def test_objects_are_passed_as_the_connection_does():
    objects = _References()
    data = _bytes(encode("(io)", (1, [7]), objects=objects))
    assert data == b"\1\0\0\0\7\0\0\0" and decode("(io)", data, objects=objects) == (1, [7])
    assert decode("m", b"\1\0\0\0o\7\0\0\0", objects=objects) == [7]
    with pytest.raises(WireError, match="no object"):
        encode("m", _Thing(), objects=objects)
    for signature, value in (("m", _Thing()), ("o", [7])):
        with pytest.raises(WireError, match="no type on the wire"):
            encode(signature, value)
    with pytest.raises(WireError, match="cannot be received"):
        decode("o", data)
    with pytest.raises(WireError, match="ends within"):
        decode("o", b"\1", objects=objects)


def test_an_object_is_given_away_once_and_only_with_the_rest():
    objects = _References()
    assert _bytes(encode("(oi)", ([7], 1.0), objects=objects)) == b"\7\0\0\0\1\0\0\0" and objects.given == [[7]]
    with pytest.raises(WireError, match="cannot convert"):
        encode("(oi)", ([8], "x"), objects=objects)
    assert objects.given == [[7]]


def test_arguments_may_come_as_a_dynamic():
    assert decode_arguments("(ii)", b"\1\0\0\0\2\0\0\0\1\0\0\0s") == ((1, 2), 8)
    data = _bytes(encode_dynamic_arguments((1 << 40, "x")))
    assert decode_arguments("(ii)", data, DYNAMIC_PAYLOAD) == decode_arguments("m", data) == ((1 << 40, "x"), len(data))
    assert _bytes(encode_arguments("m", (1 << 40, "x"))) == data
    assert decode_arguments("(ii)<P,x,y>", bytes(8))[0] == (0, 0)
    for parameters, payload, flags in (("i", bytes(4), 0), ("(i)", b"\1\0\0\0i\0\0\0\0", DYNAMIC_PAYLOAD)):
        with pytest.raises(WireError, match="tuple"):
            decode_arguments(parameters, payload, flags)
    with pytest.raises(WireError, match="2 members, not 1"):
        encode_arguments("(ii)", (1,))


def test_a_dynamic_may_be_empty_or_hold_dynamics():
    assert decode("m", bytes(4)) is None
    assert decode("m", b"\1\0\0\0m" * 20 + b"\1\0\0\0b\1") is True


MALFORMED = [
    ("i", b"\1\2\3"),
    ("(ii)", bytes(7)),
    ("b", b""),
    ("b", b"\7"),
    ("+i", b"\2"),
    ("s", b"\5\0\0\0abcd"),
    ("r", b"\xff\xff\xff\xff" + bytes(100)),
    ("[i]", b"\xff\xff\xff\xff" + bytes(100)),
    ("[s]", b"\2\0\0\0" + bytes(7)),
    ("[v]", b"\xff\xff\xff\xff"),
    ("[()]", b"\xff\xff\xff\xff"),
    ("[((v)())]", b"\xff\xff\xff\x7f" + bytes(10)),
    ("{v()}", b"\xff\xff\xff\xff"),
    ("[+v]", b"\xff\xff\xff\xff\0"),
    ("[m]", b"\xff\xff\xff\xff" + bytes(1000)),
    ("[b]", b"\2\0\0\0\1\2"),
    ("{[i]i}", b"\1\0\0\0" + bytes(8)),
    ("{mi}", b"\1\0\0\0\3\0\0\0[m]" + bytes(8)),
    ("m", b""),
    ("m", b"\1\0\0\0"),
    ("m", b"\1\0\0\0q"),
    ("m", b"\1\0\0\0X"),
    ("m", b"\1\0\0\0_"),
    ("m", b"\1\0\0\0\xff"),
    ("m", b"\2\0\0\0ii" + bytes(8)),
    ("m", b"\2\0\0\0i"),
    ("m", b"\xff\xff\xff\xff" + bytes(100)),
    ("m", b"\0\0\x10\0" + b"m" * (1 << 20)),
    ("m", b"\1\0\0\0m" * 100 + b"\1\0\0\0v"),
    ("m", b"\3\0\0\0[m]\1\0\0\0" * 100 + b"\1\0\0\0v"),
    ("m", (b"\x1f\0\0\0" + b"(" * 15 + b"m" + b")" * 15) * 100 + b"\1\0\0\0v"),
    ("X", bytes(8)),
    ("ii", bytes(8)),
    ("", bytes(8)),
]


@pytest.mark.parametrize(("signature", "payload"), MALFORMED)
def test_malformed_payloads_are_refused_in_one_line_and_little_memory(signature, payload):
    tracemalloc.start()
    try:
        with pytest.raises(WireError) as caught:
            decode(signature, payload)
        assert tracemalloc.get_traced_memory()[1] < 3 << 20
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200


@pytest.mark.parametrize("signature", ["[i]", "[s]", "[m]", "{sm}", "[(ss)]", "#o", "[[v]]"])
def test_a_count_is_compared_with_the_bytes_that_are_left(signature):
    with pytest.raises(WireError, match="1000 elements are announced, 30 bytes are left"):
        decode(signature, struct.pack("<I", 1000) + bytes(30))


def test_what_needs_more_memory_here_than_on_the_wire_is_bounded():
    for signature, payload in (("[b]", b"\1" * (5 << 20)), ("[((v)(v))]", b"")):
        with pytest.raises(WireError, match="elements"):
            decode(signature, struct.pack("<I", 5 << 20) + payload)


def test_ever_new_signatures_in_one_payload_are_bounded():
    strange = b"".join([b"\x14\0\0\0(i)<A%014d>" % n + bytes(4) for n in range(40_000)])
    with pytest.raises(WireError, match="elements"):
        decode("[m]", struct.pack("<I", 40_000) + strange)


@pytest.mark.parametrize(
    ("signature", "value"),
    [
        ("i", "x"),
        ("i", None),
        ("[i]", 5),
        ("[s]", "abc"),
        ("(ss)", "ab"),
        ("{ss}", ["a"]),
        ("s", 5),
        ("s", "\ud800"),
        ("m", "\ud800"),
        ("[m]", ["a", "\ud800"]),
        ("b", 2),
        ("r", 5),
        ("m", 1 << 64),
        ("[m]", [0, 0, 0, 0, -(1 << 70)]),
        ("m", Typed("i", "x")),
        ("m", Typed("ii", 1)),
        ("m", np.zeros(1, object)),
        ("f", 1e39),
        ("X", 1),
        ("i", Typed("s", "x")),
    ],
)
def test_values_that_have_no_form_are_refused_in_one_line(signature, value):
    with pytest.raises(WireError) as caught:
        encode(signature, value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200


def test_a_value_within_itself_is_refused():
    endless = []
    endless.append(endless)
    for value in (endless, {"a": endless}, (endless,), Typed("[m]", endless)):
        with pytest.raises(WireError, match="nested"):
            encode("m", value)
    with pytest.raises(WireError, match="nested"):
        signature_of(endless, resolve=True)


def test_values_may_be_nested_as_deep_as_is_allowed():
    value = None
    for _ in range(30):
        value = [value]
    assert decode("m", _bytes(encode("m", value))) == value


def test_random_bytes_are_values_or_refused():
    chance = random.Random(1)
    for _ in range(2000):
        data = chance.randbytes(chance.randrange(40))
        try:
            decode(chance.choice(["m", "[m]", "{sm}", "(ss[i])", "[(v)]", "+r"]), data)
        except WireError:
            pass


def test_numpy_is_not_imported():
    program = f"""
import sys
from telepresence.naoqi.codec import decode, encode
assert decode("[m]", encode("[m]", [1, 2.5, b"x", object, None][:3])[0]) == [1, 2.5, b"x"]
assert "numpy" not in sys.modules and {codec.__name__!r} in sys.modules
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
