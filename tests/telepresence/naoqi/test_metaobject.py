"""Metaobjects over the wire, and which overload a call means: as libqi 4.0 chooses."""

import pytest

from telepresence.naoqi.codec import decode, encode
from telepresence.naoqi.dynamics import Record, Typed
from telepresence.naoqi.metaobject import (
    BUILT_IN,
    METAOBJECT,
    MetaMethod,
    MetaObject,
    MetaProperty,
    MetaSignal,
    NoSuchMethod,
    choose_overload,
)
from telepresence.naoqi.signature import WireError

WHOLE = MetaObject(
    {**BUILT_IN, 100: MetaMethod(100, "v", "say", "(s)", "Speak.", (("text", "what to say"),), "nothing")},
    {101: MetaSignal(101, "spoken", "(s)"), 102: MetaSignal(102, "volume", "(f)")},
    {102: MetaProperty(102, "volume", "f")},
    "A voice.",
)


def test_a_metaobject_survives():
    payload = b"".join(encode(METAOBJECT, WHOLE.to_value()))
    value = decode(METAOBJECT, payload)
    assert isinstance(value, Record) and value.methods[100].parametersSignature == "(s)"
    assert MetaObject.from_value(value) == WHOLE
    assert WHOLE.signal("volume") == (102, "volume", "(f)") and WHOLE.property("volume") == (102, "volume", "f")
    assert WHOLE.signal("x") is WHOLE.property("x") is None


@pytest.mark.parametrize(
    "value", [None, (), ({}, {}, {}), ([], {}, {}, ""), ({1: ()}, {}, {}, ""), ({}, {1: 2}, {}, "")]
)
def test_what_is_no_metaobject_is_refused(value):
    with pytest.raises(WireError, match="no description of an object"):
        MetaObject.from_value(value)


def _object(*parameters):
    return MetaObject({100 + n: MetaMethod(100 + n, "v", "over", text) for n, text in enumerate(parameters)})


@pytest.mark.parametrize(
    ("overloads", "arguments", "chosen"),
    [
        (("(i)", "(f)", "(s)", "([f])", "([s])"), (1,), "(i)"),
        (("(i)", "(f)", "(s)", "([f])", "([s])"), (1.5,), "(f)"),
        (("(i)", "(f)", "(s)", "([f])", "([s])"), ("x",), "(s)"),
        (("(i)", "(f)", "(s)", "([f])", "([s])"), (True,), "(i)"),
        (("(i)", "(f)", "(s)", "([f])", "([s])"), ([1, 2],), "([f])"),
        (("(i)", "(f)", "(s)", "([f])", "([s])"), (["a"],), "([s])"),
        (("(i)", "(f)"), (Typed("f", 1),), "(f)"),
        (("(sb)", "(mm)"), ("a", True), "(mm)"),
        (("({sm})", "((ss))", "([m])"), ({"a": 1},), "({sm})"),
        (("({sm})", "((ss))", "([m])"), (("a", "b"),), "((ss))"),
        (("({sm})", "((ss))", "([m])"), ([1, "b"],), "([m])"),
        (("(b)", "(i)"), (1,), "(i)"),
        (("(b)", "(i)"), (1.5,), "(i)"),
        (("(i)", "(ii)"), (1, 2), "(ii)"),
        (("(i)",), ("x",), "(i)"),
        (("m",), (1, 2, 3), "m"),
        (("(i", "(f)"), (1,), "(f)"),
    ],
)
def test_overloads_are_chosen_as_libqi_does(overloads, arguments, chosen):
    assert choose_overload(_object(*overloads), "over", arguments).parameters == chosen


def test_an_overload_may_be_named_with_its_types():
    meta = _object("(i)", "(f)")
    assert choose_overload(meta, "over::(f)", (1,)).uid == 101
    assert choose_overload(meta, "over::v(i)", (1.5,)).uid == 100


@pytest.mark.parametrize(
    ("name", "arguments", "text"),
    [
        ("nope", (1,), "Can't find method: nope (resolved to '(l)')"),
        (
            "over::(w)",
            (1,),
            "Can't find method: over::(w) (resolved to '(l)'):\n  Candidates:\n  over::(f)\n  over::(d)",
        ),
        ("over", (1,), "Ambiguous overload for over (resolved to '(l)'):\n  Candidates:\n  over::(f)\n  over::(d)"),
        (
            "over",
            (None,),
            "Arguments types did not match for over (resolved to '(v)'):\n  Candidates:\n  over::(f)\n  over::(d)",
        ),
        (
            "over",
            (1, 2),
            "Arguments types did not match for over (resolved to '(ll)'):\n  Candidates:\n  over::(f)\n  over::(d)",
        ),
    ],
)
def test_a_call_that_means_no_method_says_so_as_libqi_does(name, arguments, text):
    with pytest.raises(RuntimeError) as caught:
        choose_overload(_object("(f)", "(d)"), name, arguments)
    assert str(caught.value) == text
    assert (
        isinstance(caught.value, NoSuchMethod) == isinstance(caught.value, AttributeError) == text.startswith("Can't")
    )
