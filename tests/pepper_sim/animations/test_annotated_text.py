"""Texts with instructions, taken apart."""

import pytest
from reading_cost import grows_in_proportion

from pepper_sim.animations.annotated_text import Event, Instruction, Words, parse, parse_call


def test_a_text_is_split_at_its_instructions():
    items = parse("Hi ^start(animations/Stand/Gestures/Hey_1) $met/user=yes you ^startTag(animations/Stand, hello)")
    assert items == [
        Words("Hi "),
        Instruction("start", ("animations/Stand/Gestures/Hey_1",), "animations/Stand/Gestures/Hey_1"),
        Event("met/user", "yes"),
        Words(" you "),
        Instruction("startTag", ("animations/Stand", "hello"), "animations/Stand, hello"),
    ]
    assert parse("^wait(never ends") == [Words("never ends")]
    assert parse("it costs 5 $ and 2^3") == [Words("it costs 5 $ and 2^3")]
    assert [item.text for item in parse("^call(ALMotion.setAngles('HeadYaw', (0.1), 0.2))")] == [
        "ALMotion.setAngles('HeadYaw', (0.1), 0.2)"
    ]


@pytest.mark.parametrize(
    ("text", "call"),
    [
        ("ALMotion.wakeUp()", ("ALMotion", "wakeUp", [])),
        ("ALMemory.raiseEvent(my_event, my_value)", ("ALMemory", "raiseEvent", ["my_event", "my_value"])),
        ("ALLeds.fadeRGB('FaceLeds', 255, 0.5)", ("ALLeds", "fadeRGB", ["FaceLeds", 255, 0.5])),
        ("ALBasicAwareness.setEnabled(true)", ("ALBasicAwareness", "setEnabled", [True])),
        ("ALMotion.setAngles(['HeadYaw'], [0.1], 0.2)", ("ALMotion", "setAngles", [["HeadYaw"], [0.1], 0.2])),
    ],
)
def test_calls(text, call):
    assert parse_call(text) == call


def test_what_is_no_call_is_refused():
    for text in ("ALMotion.wakeUp", "wakeUp()", "__import__('os').system('ls')"):
        with pytest.raises(ValueError, match="no call"):
            parse_call(text)


def test_what_an_unclosed_instruction_contains_is_carried_out():
    assert parse("^wait(never ends ^start(this) and (that) ^stop(") == [
        Words("never ends "),
        Instruction("start", ("this",), "this"),
        Words(" and (that) "),
    ]


@pytest.mark.parametrize("part", ["^", "^a(", "$a=", "^a ", "$a "])
def test_a_text_is_read_in_time_proportional_to_its_length(part):
    assert grows_in_proportion(parse, part)
    assert grows_in_proportion(lambda text: parse(text + ")"), part), "the bracket that closes is the last letter"
