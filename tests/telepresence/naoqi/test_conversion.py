"""libqi's implicit conversions, and what has none."""

import math

import numpy as np
import pytest

from telepresence.naoqi.conversion import ConversionError, convert
from telepresence.naoqi.dynamics import Record, Typed

NAN = float("nan")


@pytest.mark.parametrize(
    ("value", "signature", "converted"),
    [
        (2.9, "i", 2),
        (-2.9, "i", -2),
        (True, "i", 1),
        (255, "C", 255),
        (1, "f", 1.0),
        (True, "d", 1.0),
        (1, "b", True),
        (0.0, "b", False),
        (math.inf, "f", math.inf),
        ("ä", "r", "ä".encode()),
        (b"\xff", "s", b"\xff"),
        (bytearray(b"ab"), "s", b"ab"),
        (5, "v", None),
        ((1, 2.5), "[i]", [1, 2]),
        ({1}, "[f]", [1.0]),
        ({"a": 1}.keys(), "[s]", ["a"]),
        ([1, 2.5], "(fi)", (1.0, 2)),
        ([["a", 1], ("b", 2)], "{sf}", {"a": 1.0, "b": 2.0}),
        ({1: 2.5}, "{fi}", {1.0: 2}),
        ({"y": 2, "x": 1.9, "z": 0}, "(ii)<P,x,y>", (1, 2)),
        (Record(x=1, y=2), "{si}", {"x": 1, "y": 2}),
        ({"name": "a"}, "(s+s)<P,name,nick>", ("a", None)),
        ({"name": "a"}, "(ss)<P,name,objectUid>", ("a", "")),
        (None, "+i", None),
        (2.5, "+i", 2),
        ([1.5], "#i", [1]),
        (None, "m", None),
        (Typed("f", 1), "i", 1),
        (np.float32(2.5), "i", 2),
        (np.int64(3), "f", 3.0),
        (np.bool_(True), "b", True),
        (np.arange(3), "[f]", [0.0, 1.0, 2.0]),
        (np.arange(2), "(ff)", (0.0, 1.0)),
    ],
)
def test_values_become_what_is_declared(value, signature, converted):
    result = convert(value, signature)
    assert result == converted and type(result) is type(converted)


@pytest.mark.parametrize("signature", ["f", "d", "m"])
def test_not_a_number_passes(signature):
    assert math.isnan(convert(NAN, signature))


@pytest.mark.parametrize(
    ("value", "signature"),
    [
        (2**31, "i"),
        (-1, "I"),
        (256, "C"),
        (2**64, "L"),
        (NAN, "i"),
        (math.inf, "l"),
        (2, "b"),
        (0.5, "b"),
        ("true", "b"),
        ("1", "i"),
        (None, "i"),
        (None, "s"),
        (1e39, "f"),
        (10**400, "d"),
        *(pytest.param(10**5000, signature, id=f"many digits-{signature}") for signature in "idbs"),
        (1, "s"),
        (memoryview(b"raw"), "s"),
        ("\ud800", "s"),
        (5, "r"),
        ("abc", "[s]"),
        ({"a": 1}, "[m]"),
        ([1, "x"], "[i]"),
        ([1], "(ii)"),
        (5, "(i)"),
        ({"x": 1}, "(ii)"),
        ({"x": 1}, "(ii)<P,x,y>"),
        ([1, 2], "{ii}"),
        ([[[], 1]], "{mi}"),
        (1, "X"),
        (object(), "i"),
        (np.zeros((2, 2)), "[f]"),
    ],
)
def test_what_has_no_form_is_refused_in_one_line(value, signature):
    with pytest.raises(ConversionError) as caught:
        convert(value, signature)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200
