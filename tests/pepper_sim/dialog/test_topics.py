"""Topics are read, or the error says where they cannot be."""

import random

import pytest

from pepper_sim.dialog.answers import unknown_functions
from pepper_sim.dialog.conversation import Conversation
from pepper_sim.dialog.grammar import read_grammar
from pepper_sim.dialog.nodes import TopicError
from pepper_sim.dialog.reader import read_topic

EVERYTHING = """topic: ~all ^noPick ()
language: enu
concept:(x) [a "b c" ~x {d}]
dynamic: y
u:(_~x [b "c {d}"] !no * $v==3 e:Ev %t ^exact) hi $1 $v=2 ^rand[a "b $x<>1"] ^goto(t) %t ^call(A.b("x", 1)) {a b}
  u1:(yes) ^stayInScope
c1:(_*) $1
e1: no
proposal: %t hello
l:(i _*) $l=$1
s:(*) ^addword(hey, start, 1)
def:f($a) ^first["$a > 1 x" y]
"""


def test_a_topic_holds_what_its_text_says():
    topic = read_topic("\ufeff# greeting\n" + EVERYTHING)
    assert (topic.name, topic.language, topic.properties) == ("all", "English", {"noPick"})
    assert [rule.kind for rule in topic.rules] == ["u", "proposal", "l", "s"]
    assert [rule.kind for rule in topic.rules[0].scope] == ["u", "c", "e"]
    assert topic.dynamics == ["y"] and set(topic.concepts) == {"x"} and set(topic.definitions) == {"f"}
    assert topic.events == {"Ev"} and topic.rules[0].line == 6


@pytest.mark.parametrize(
    ("text", "line", "column", "problem"),
    [
        ("", 1, 1, "topic: ~name()"),
        ("\n  u:(hello) hi", 2, 3, "topic: ~name()"),
        ("topic: greeting()", 1, 8, "~name()"),
        ("topic: ~a()\nlanguage: klingon", 2, 11, "klingon"),
        ("topic: ~a()\nu: hello", 2, 4, "parentheses"),
        ("topic: ~a()\nu:(hello hi", 2, 3, "')' is missing"),
        ("topic: ~a()\nu:(a [b c) d", 2, 10, "']' is missing"),
        ("topic: ~a()\n# [\nu:(a) b [c", 3, 9, "']' is missing"),
        ("topic: ~a()\nu:(a) b]", 2, 8, "']'"),
        ('topic: ~a()\nu:(a) "b', 2, 7, "'\"' is missing"),
        ("topic: ~a()\n u2:(a) b", 2, 2, "level 1"),
        ("topic: ~a()\nu:(a _) b", 2, 6, "'_' needs"),
        ("topic: ~a()\nu:(a) $ b", 2, 7, "variable"),
        ("topic: ~a()\nu:(a) ^goto(b", 2, 12, "')' is missing"),
        ("topic: ~a()\nu:(a) b\n%script\nprint 1\n%script", 3, 1, "%script"),
        ("topic: ~a()\nconcept: b c", 2, 10, "concept:(name)"),
        ("topic: ~a()\nu:(" + "[" * 60, 2, 43, "nested"),
    ],
)
def test_an_error_names_line_and_column(text, line, column, problem):
    with pytest.raises(TopicError, match=f"line {line}, column {column}: ") as caught:
        read_topic(text)
    assert problem in str(caught.value)


def test_functions_that_nobody_carries_out_are_listed():
    topic = read_topic("topic: ~a()\nu:(a) ^wiki(b) ^first[^goto(c) ^f]\ndef:f() ^start(d) ^rand[e]\n")
    assert unknown_functions(topic) == ["wiki"]


def test_no_text_is_too_odd():
    """Every mutation of a topic is read, or refused with a place inside it; those that are read can be talked with."""
    numbers, read = random.Random(17), 0
    for _ in range(250):
        text = list(EVERYTHING)
        for _ in range(numbers.randint(1, 6)):
            at = numbers.randrange(len(text))
            match numbers.randrange(3):
                case 0:
                    del text[at : at + numbers.randint(1, 8)]
                case 1:
                    text.insert(at, numbers.choice('[]{}()"~$^%_*!:#\n uce12=<>,\\é'))
                case 2:
                    text[at:at] = text[numbers.randrange(len(text)) :][:20]
        try:
            topic = read_topic("".join(text))
        except TopicError as error:
            assert 1 <= error.line <= text.count("\n") + 1 and error.column >= 1
            continue
        read += 1
        variables: dict[str, str] = {}
        conversation = Conversation(variables.get, variables.__setitem__, lambda _: None, numbers)
        conversation.add(topic)
        conversation.activate(topic.name)
        for said in ("a b c", "yes", "b c b c d foo 3", ""):
            reaction = conversation.react(said)
            if reaction is not None:
                conversation.settle(reaction)
    assert 20 < read < 230


def test_a_grammar_is_read_or_refused_with_its_place():
    grammar = read_grammar(
        "#BNF+EM V1.1;\n!grammar lights;\n!start <go>;\n!activatable <colour>;\n!slot <what>;\n"
        "<go>: switch !optional(please) the (light | <what>) <colour>;\n<colour>: red | green;\n"
    )
    assert (grammar.name, grammar.start, grammar.slots) == ("lights", ["go"], ["what"])
    for text, place in (("!start <a>;\n<a>: (b;", "line 2, column 8"), ("<a>: b", "line 1, column 6"), ("", "line 1")):
        with pytest.raises(TopicError, match=place):
            read_grammar(text)
