"""Conversations, most of them as the documentation of QiChat describes what a rule does."""

import random

import pytest

from pepper_sim.dialog.conversation import Conversation
from pepper_sim.dialog.reader import read_topic


@pytest.fixture
def talk():
    """Load topics, then say sentences ("!Name" raises an event); returns what the robot answers, None for nothing."""
    variables: dict[str, str] = {}
    conversation = Conversation(variables.get, variables.__setitem__, lambda _: None, random.Random(3))

    def say(*sentences):
        answers = []
        for sentence in sentences:
            event = sentence.startswith("!")
            reaction = conversation.react_to_event(sentence[1:]) if event else conversation.react(sentence)
            answers.append(None if reaction is None else reaction.answer.text)
            if reaction is not None:
                conversation.settle(reaction)
        return answers

    def load(*texts):
        for text in texts:
            topic = read_topic(text)
            conversation.add(topic)
            conversation.activate(topic.name)
        return say

    load.conversation = conversation
    load.variables = variables
    return load


def test_words_choices_options_and_more_words_than_the_rule_has(talk):
    say = talk('topic: ~a()\nu:([hi "good day"] {dear} robot) [hello "what is up"] human\nu:(help ^exact) which\n')
    assert say("Good day, robot!", "well hi dear robot, you there", "hi", "HELP", "help me") == [
        "hello human",
        "what is up human",
        None,
        "which",
        None,
    ]


def test_concepts_captures_and_variables(talk):
    say = talk(
        "topic: ~a()\nconcept:(wine) [red white] wine\nconcept:(drink) [beer ~wine]\n"
        "u:(do you have _~drink) yes, $1 $last=$1\nu:(my name is _*) hello $1!\n"
        'u:(what was it) ^first["it was $last" "I forgot"]\nu:(offer something) ~drink?\n'
    )
    assert say("what was it", "do you have White Wine please", "what was it", "my name is Ada Lovelace") == [
        "I forgot",
        "yes, White Wine",
        "it was White Wine",
        "hello Ada Lovelace!",
    ]
    assert say("offer something", "offer something", "offer something", "offer something") == [
        "beer?",
        "red wine?",
        "white wine?",
        "beer?",
    ]


def test_a_concept_that_holds_itself_ends(talk):
    assert talk("topic: ~a()\nconcept:(x) [a ~x]\nu:(~x) got ~x\n")("a", "b") == ["got a", None]
    doubling = "".join(f"concept:(c{depth}) [~c{depth + 1} ~c{depth + 1}]\n" for depth in range(40))
    functions = "".join(f"def:f{depth}() ^f{depth + 1} ^f{depth + 1}\n" for depth in range(25))
    say = talk(f"topic: ~b()\n{doubling}concept:(c40) x\n{functions}def:f25() y\nu:(~c0) ~c0\nu:(deep) ^f0\n")
    assert say("x", "deep") == [None, None], "2 to the power of 40 ways are not tried"


def test_scopes_open_and_close(talk):
    say = talk(
        "topic: ~a()\nu:(animals) a cat or a dog?\n u1:(dog) big?\n  u2:(yes) space\n u1:(cat) outside?\n"
        "  u2:(no) sad\n u1:(bird) sings ^stayInScope\nu:(sport) good\n"
    )
    assert say("dog", "animals", "I have a cat", "dog", "no") == [None, "a cat or a dog?", "outside?", None, "sad"]
    assert say("animals", "bird", "dog", "sport", "yes") == ["a cat or a dog?", "sings", "big?", "good", None]


def test_proposals_are_said_once_and_have_scopes(talk):
    say = talk(
        "topic: ~a()\nu:(next) ^nextProposal\nu:(again) once more: ^sameProposal\nu:(back) ^previousProposal\n"
        "u:(love) yes, ^gotoReactivate(love)\nproposal: %love I love you\nproposal: tea?\n u1:(no) coffee?\n"
    )
    assert say("next", "next", "again", "back", "next", "love") == [
        "I love you",
        "tea?",
        "once more: tea?",
        "I love you",
        "",
        "yes, I love you",
    ]
    talk.conversation.reset()
    assert say("next", "next", "no") == ["I love you", "tea?", "coffee?"]
    talk.conversation.remove("a")
    assert talk("topic: ~a()\nu:(next) ^nextProposal\nproposal: %new hello\n")("next") == ["hello"]


def test_goto_topic_tag_and_random(talk):
    say = talk(
        "topic: ~one()\nu:(first) to ^goto(t)\nu:(zz) %t there\n u1:(deeper) deep\nu:(other) ^topicTag(two,x)\n"
        "u:(chance) ^rand[a b c]\nu:(loop) %l ^goto(l)\n",
        "topic: ~two()\nproposal: %x from two\nu:(hello two) hi\n",
    )
    assert say("first", "deeper", "other") == ["to there", "deep", "from two"]
    assert talk.conversation.focus == "two"
    assert set(say(*["chance"] * 30)) == {"a", "b", "c"}
    assert say("loop") == [None]


def test_conditions_tags_and_what_cannot_be_said(talk):
    say = talk(
        'topic: ~a()\nu:(count _*) $n=$1 ok\nu:(how many) ["$n>5 many" "$n<=5 few"]\nu:(secret %s) told\n'
        "u:(hide) ^deactivate(s) hidden\nu:(show) ^activate(s) shown\nu:(forget) ^clear(n) ok\n"
        "u:(e:Dialog/SpeakFailure) no words\nu:(e:Dialog/NotUnderstood) what?\n"
    )
    assert say("how many", "count 7", "how many", "count 2", "how many", "forget", "how many") == [
        "no words",
        "ok",
        "many",
        "ok",
        "few",
        "ok",
        "no words",
    ]
    assert say("secret", "hide", "secret", "show", "secret") == ["told", "hidden", "what?", "shown", "told"]


def test_events_alone_and_with_words(talk):
    say = talk(
        'topic: ~a()\nu:([e:Left "move it"]) moved\nu:(e:Count $Count==2) two\nu:(!never say it) said\n'
        "u:(say it) twice\n"
    )
    talk.variables["Count"] = "1"
    assert say("!Left", "move it", "!Count", "say it", "never say it") == ["moved", "moved", None, "said", "twice"]
    talk.variables["Count"] = "2"
    assert say("!Count", "!Other") == ["two", None]
    assert talk.conversation.events == {"Left", "Count"}


def test_focus_private_fallback_and_overload(talk):
    say = talk(
        "topic: ~music()\nu:(music) ok\nu:^private(what is it) music\nu:(same) from music\n",
        "topic: ~cars()\nu:(cars) ok\nu:(same) from cars\n",
        "topic: ~rest ^fallback ()\nu:(_*) I heard $1\n",
    )
    assert say("what is it", "music", "what is it", "cars", "same", "music", "same") == [
        "I heard what is it",
        "ok",
        "music",
        "ok",
        "from cars",
        "ok",
        "from music",
    ]


def test_dynamic_concepts_functions_and_skins(talk):
    say = talk(
        'topic: ~a()\ndynamic: fridge\nu:(put _[coke "iced tea"]) ok ^addToConcept(~fridge, $1)\n'
        "u:(what is in it) ^size(~fridge): ^enumerate(~fridge)\nu:(is there _[coke milk]) "
        '^first["^isInConcept(~fridge, $1) yes" no]\ndef:age($a) ^first["$a > 18 adult" child]\n'
        "u:(I am _*) an ^age($1)\nu:(plain) hello human\ns:(hello human) ^replace(human, friend, 1)\n"
    )
    assert say("put coke", "put iced tea", "what is in it", "is there coke", "is there milk") == [
        "ok",
        "ok",
        "2: iced tea coke",
        "yes",
        "no",
    ]
    assert say("I am 20", "I am 7", "plain") == ["an adult", "an child", "hello friend"]


def test_languages_are_apart(talk):
    say = talk("topic: ~a()\nlanguage: enu\nu:(hello) hello\n", "topic: ~a()\nlanguage: French\nu:(bonjour) salut\n")
    assert say("bonjour", "hello") == [None, "hello"]
    talk.conversation.language = "French"
    assert say("bonjour", "hello") == ["salut", None]
    assert talk.conversation.loaded() == ["a", "a"] and talk.conversation.loaded("French") == ["a"]
    talk.conversation.remove("a")
    assert talk.conversation.loaded() == []


def test_misses_are_counted(talk):
    say = talk(
        "topic: ~a()\nu:(e:Dialog/NotUnderstood) what\nu:(e:Dialog/NotUnderstood2) sorry\nu:(e:Dialog/Failure) bye\n"
    )
    assert say("x", "y", "z") == ["what", "sorry", "bye"]
