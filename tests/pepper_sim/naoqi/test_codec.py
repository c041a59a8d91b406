"""Values on the wire: what is written is read back, and nonsense is refused."""

import random

import numpy as np
import pytest

from pepper_sim.naoqi.codec import (
    METAOBJECT,
    CodecError,
    Decoder,
    Encoder,
    Header,
    MethodDescription,
    dynamic_kind,
    metaobject,
    split_signature,
)


def _round_trip(signature, value):
    return Decoder(b"".join(Encoder().put(signature, value).buffers())).get(signature)


@pytest.mark.parametrize(
    ("signature", "value"),
    [
        ("i", -5),
        ("I", 2**32 - 1),
        ("l", -(2**63)),
        ("b", True),
        ("d", 0.1),
        ("s", "häh \u2603"),
        ("r", b"\x00\xff"),
        ("[s]", ["a", ""]),
        ("{sI}", {"a": 1, "b": 2}),
        ("(is[f])", (1, "x", [0.5, -2.0])),
        ("[m]", [1, "a", None, True, [2, [0.5]], b"\xff"]),
        ("m", {"a": 1}),
        ("()", ()),
    ],
)
def test_values_survive(signature, value):
    assert _round_trip(signature, value) == value


def test_dynamics_use_the_types_of_a_real_robot():
    assert [dynamic_kind(v) for v in (1, 2**40, 0.5, "a", b"a", np.zeros(2), [1], None, True)] == [
        *("i", "l", "f", "s", "r", "r", "[m]", "v", "b")
    ]


def test_a_picture_is_not_copied():
    pixels = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    buffers = Encoder().put("[m]", [1, pixels, 2]).buffers()
    assert any(isinstance(part, memoryview) and np.shares_memory(np.asarray(part), pixels) for part in buffers)


def test_signatures_split_and_lose_their_annotations():
    assert split_signature("b(fff)") == ("b", "(fff)")
    assert split_signature("(sI)<Info<x>,name,id>[m]+s") == ("(sI)", "[m]", "+s")
    for bad in ("(", "[s", "q", "{s}<", "[" * 100 + "]" * 100):
        with pytest.raises(CodecError):
            split_signature(bad)


@pytest.mark.parametrize("value", ["x", None, 2**31, [1]])
def test_values_that_do_not_fit_are_refused(value):
    with pytest.raises(CodecError):
        Encoder().put("i", value)


def test_random_bytes_never_do_more_than_raise():
    dice = random.Random(5)
    kinds = ["m", "[m]", "{sm}", "(sIs[m])", METAOBJECT, "s", "r"]
    for _ in range(3000):
        payload = dice.randbytes(dice.randrange(0, 60))
        try:
            Decoder(payload).get(dice.choice(kinds))
        except CodecError:
            continue


def test_announced_sizes_are_not_believed():
    for signature in ("s", "r", "[m]", "{sm}"):
        with pytest.raises(CodecError):
            Decoder(b"\xff\xff\xff\xff").get(signature)


def test_headers():
    header = Header(7, 12, 1, 2, 1, 100)
    assert Header.unpack(header.pack()) == header
    with pytest.raises(CodecError, match="not a qi message"):
        Header.unpack(b"GET / HTTP/1.1\r\nHost: robot\r\n"[:28])


def test_metaobjects_list_methods_by_number():
    value = metaobject([MethodDescription(100, "s", "say", "(s)")], [(106, "heard", "(s)")])
    methods, signals, properties, _ = _round_trip(METAOBJECT, value)
    assert methods[100][2] == "say" and methods[2][2] == "metaObject"
    assert signals[106] == (106, "heard", "(s)") and properties == {}
