"""Signatures: what they consist of, and how well one converts to another."""

import pytest

from telepresence.naoqi import signature
from telepresence.naoqi.metaobject import METAOBJECT
from telepresence.naoqi.signature import Annotation, WireError, convertibility, parse, split

SERVICE_INFO = "(sIsI[s]ss)<ServiceInfo,name,serviceId,machineId,processId,endpoints,sessionId,objectUid>"


def test_a_signature_knows_its_parts():
    kind = parse("({I(sm)}[+f])")
    assert kind.code == "(" and [child.text for child in kind.children] == ["{I(sm)}", "[+f]"]
    assert kind.depth == 3 and parse("m").depth == 0


def test_annotations_are_kept_aside():
    kind = parse(SERVICE_INFO)
    assert kind.text == "(sIsI[s]ss)" and kind.full == SERVICE_INFO
    assert kind.annotation == Annotation("ServiceInfo", tuple(SERVICE_INFO[24:-1].split(",")))
    nested = parse("[(ss)<A<x,y>,b,c>]<Outer>")
    assert nested.annotation == ("Outer", ()) and nested.children[0].annotation == ("A<x,y>", ("b", "c"))
    assert parse("i<unit>").annotation == ("unit", ()) and parse("i<unit>").text == "i"


def test_annotations_do_not_count_for_equality():
    assert parse("(ss)<A,x,y>") == parse("(ss)") != parse("(sm)")
    assert len({parse("(ss)<A,x,y>"), parse("(ss)")}) == 1


def test_signatures_split():
    assert split("(ss[i])<P,a>b+m") == ("(ss[i])<P,a>", "b", "+m")
    assert split("") == ()
    assert parse(METAOBJECT).children[0].children[1].children[5].text == "[(ss)]"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "q",
        "ii",
        "(i",
        "i)",
        "[",
        "[]",
        "[ii]",
        "{s}",
        "{sss}",
        "+",
        "#",
        "(i]",
        "i<a",
        "(i)<",
        "<a>",
        "é",
        "(é)",
        "\0",
    ],
)
def test_what_is_no_signature_is_refused(text):
    with pytest.raises(WireError, match="Invalid signature") as caught:
        parse(text)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200


@pytest.mark.parametrize(
    "text", ["[" * 40 + "i" + "]" * 40, "[" * 1_000_000, "+" * 10_000 + "i", "(" * 2000, "m" * 1_000_000]
)
def test_endless_signatures_are_refused(text):
    with pytest.raises(WireError, match=r"deeper|characters") as caught:
        parse(text)
    assert len(str(caught.value)) < 200


def test_a_signature_may_be_as_deep_as_a_value():
    assert parse("[" * 32 + "i" + "]" * 32).depth == 32
    with pytest.raises(WireError, match="deeper"):
        parse("[" * 33 + "i" + "]" * 33)


def test_what_peers_choose_does_not_fill_the_memory():
    for number in range(20_000):
        parse(f"(i)<A{number}>")
    assert len(signature._PARSED) < 2000


@pytest.mark.parametrize(
    ("source", "target", "score"),
    [
        ("i", "i", 1.0),
        ("i", "L", 1.0),
        ("i", "v", 1.0),
        ("i", "m", 0.95),
        ("i", "X", 0.9),
        ("i", "f", 0.98),
        ("d", "i", 0.97),
        ("d", "f", 1.0),
        ("i", "b", 0.96),
        ("f", "b", 0.93),
        ("b", "b", 1.0),
        ("b", "i", 1.0),
        ("s", "s", 1.0),
        ("s", "i", 0.0),
        ("m", "i", 0.0),
        ("v", "i", 0.0),
        ("r", "s", 0.0),
        ("[i]", "[f]", 1 - 0.02 * 0.95),
        ("[i]", "[s]", 0.0),
        ("(im)", "(fm)", (1 - 0.02 * 0.95) * (1 - 0.05 * 0.95)),
        ("(ii)", "(i)", 0.0),
        ("(ii)<P,a,b>", "(i)<P,a>", 0.1),
        ("(ii)<P,a,b>", "(i)<Q,a>", 0.0),
        ("{si}", "{si}", 1.0),
        ("{si}", "[m]", 0.0),
        ("i", "+i", 1.0),
        ("v", "+i", 1.0),
        ("+i", "+f", 0.98),
        ("+i", "i", 0.0),
        ("+i", "m", 0.95),
    ],
)
def test_types_convert_as_libqi_scores_them(source, target, score):
    assert convertibility(source, target) == pytest.approx(score)
