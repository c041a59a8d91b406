"""A conversation: which topics are active, which rule answers, what its scope is. No threads, no speech.

`react` finds the answer to a sentence or an event; `settle` carries out what the answer causes, once it has been said.
Source: NAOqi 2.8 documentation, ALDialog and "QiChat - Syntax".
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from pepper_sim.dialog.answers import REMEMBERING, Answer, AnswerMaker, Effect, Unsayable
from pepper_sim.dialog.concepts import Concepts
from pepper_sim.dialog.matching import Match, Matcher, Utterance
from pepper_sim.dialog.nodes import Definition, Function, Rule, Sequence, Topic, walk
from pepper_sim.dialog.skins import dressed
from pepper_sim.dialog.topics import Topics

NOT_UNDERSTOOD = "Dialog/NotUnderstood"
SPEAK_FAILURE = "Dialog/SpeakFailure"
SAME_RULE = "Dialog/SameRule"
FALLBACK = "Dialog/Fallback"
FAILURE = "Dialog/Failure"
FAILURES = 3
"""Number of sentences in a row that, not understood, are a failure."""


@dataclass
class Reaction:
    """An answer, with what it answers to.

    Attributes:
        match: The rule that matched; None for a proposal that nobody asked for.
        rules: The rule that is said, then those that it jumps to.
        understood: False if the answer is one to "not understood".
    """

    answer: Answer
    rules: list[Rule] = field(default_factory=list)
    match: Match | None = None
    understood: bool = True

    @property
    def rule(self) -> Rule | None:
        return self.rules[0] if self.rules else None


class Conversation(Topics):
    """The topics of one robot, in all languages.

    Args:
        read: Returns a variable as text; None if it is not set.
        write: Sets a variable, "" to clear it.
        user_info: Returns what is known of the user who speaks.
        knowledge: Carries out one of QiChat's functions about knowledge; see `answers.Speaker`.
    """

    def __init__(
        self,
        read: Callable[[str], str | None],
        write: Callable[[str, str], None],
        user_info: Callable[[str], str | None],
        random_numbers: random.Random | None = None,
        knowledge: Callable[[str, list[str]], str | None] = lambda function, arguments: None,
    ) -> None:
        super().__init__()
        self.knowledge = knowledge
        self.concepts = Concepts()
        self.focus = ""
        self.pushing = False
        self.renamed: dict[tuple[str, str], str] = {}
        """(topic, event) -> the name that a program has given to the event."""
        self._read = read
        self._write = write
        self.user_info = user_info
        self._random = random_numbers or random.Random()
        self._scope: list[Rule] = []
        self._last: Rule | None = None
        self._said: dict[str, list[Rule]] = {}
        """Topic -> its proposals in the order in which they were said."""
        self._used: set[Rule] = set()
        self._inactive_tags: set[tuple[str, str]] = set()
        self._turns: dict[tuple[str, int], int] = {}
        self._misses = 0

    # --- topics ------------------------------------------------------------------------------------------------------

    def deactivate(self, name: str) -> None:
        """Let a topic answer no more; its scope is left, and the focus."""
        super().deactivate(name)
        self._scope = [rule for rule in self._scope if rule.topic != name]
        if self.focus == name:
            self.focus = ""

    def remove(self, name: str) -> None:
        """Unload a topic in all languages, and forget what was said of it."""
        super().remove(name)
        self._used = {rule for rule in self._used if rule.topic != name}
        self._said.pop(name, None)

    def sentences(self, topic: Topic) -> list[str]:
        """List the sentences that a topic's rules wait for, at most `concepts.MAX_TEXTS` of each rule."""
        found = [
            text
            for rule in topic.all_rules()
            if rule.input is not None and rule.kind == "u"
            for text in self.concepts.texts(rule.input, self.concept)
        ]
        return [text for text in dict.fromkeys(found) if text]

    @property
    def events(self) -> set[str]:
        """The events that the active topics wait for."""
        return {self.renamed.get((topic.name, name), name) for topic in self.active for name in topic.events}

    @property
    def in_scope(self) -> bool:
        """Whether rules of a scope wait for an answer."""
        return bool(self._scope)

    def reset(self) -> None:
        """Make every proposal new again and leave the scope."""
        self._used.clear()
        self._said.clear()
        self._scope = []

    def set_tag(self, topic: str, tag: str, active: bool) -> None:
        """Activate or deactivate a tag of a topic."""
        (self._inactive_tags.discard if active else self._inactive_tags.add)((topic, tag))

    # --- reactions ---------------------------------------------------------------------------------------------------

    def react(self, text: str, recent_events: Iterable[str] = ()) -> Reaction | None:
        """Return the answer to a sentence; None if there is none.

        Args:
            recent_events: Events that a rule may require before the sentence.
        """
        match = self._best(Utterance.of(text, recent_events))
        if match is None:
            self._misses += 1
            number = "" if self._misses == 1 else str(min(self._misses, FAILURES))
            names = [FAILURE] * (self._misses >= FAILURES) + [NOT_UNDERSTOOD + number, NOT_UNDERSTOOD]
            return self._first_of(names, understood=False)
        self._misses = 0
        if match.rule is self._last and (same := self._first_of([SAME_RULE])) is not None:
            return same
        return self._reaction(match)

    def react_to_event(self, event: str) -> Reaction | None:
        """Return the answer to an event; None if no rule waits for it."""
        match = self._best(Utterance.of("", [event]))
        return None if match is None else self._reaction(match)

    def react_to_result(self, rule: Rule, result: str | None) -> Reaction | None:
        """Return the answer to the result of a call in `rule`; None as result stands for a call that failed."""
        if not result:
            failed = next((inner for inner in rule.scope if inner.kind == "e"), None)
            return None if failed is None else self._reaction(Match(failed, 0, True))
        utterance = Utterance.of(result)
        found = [self._match(utterance, inner) for inner in rule.scope if inner.kind == "c"]
        matches = [match for match in found if match is not None]
        return self._reaction(max(matches, key=lambda match: match.literal)) if matches else None

    def propose(self, topic_name: str = "") -> Reaction | None:
        """Return the next proposal of a topic, by default of the one that has the focus."""
        names = [topic_name] if topic_name else [self.focus, *(topic.name for topic in self.active)][:1]
        for name in names:
            for rule in self._open_proposals(name):
                reaction = self._said_of(rule)
                if reaction is not None:
                    return reaction
        return None

    def tagged(self, topic: str, tag: str) -> Reaction | None:
        """Return the sentence of a topic that has a tag."""
        for rule in self._rules_with(topic, tag):
            reaction = self._said_of(rule)
            if reaction is not None:
                return reaction
        return None

    def settle(self, reaction: Reaction) -> None:
        """Carry out what a reaction causes, after it has been said. Calls are left to the caller."""
        rules = reaction.rules + [effect.arguments[0] for effect in reaction.answer.effects if effect.kind == "scope"]
        for rule in rules:
            if rule.kind == "proposal":
                self._used.add(rule)
                said = self._said.setdefault(rule.topic, [])
                said += [] if said[-1:] == [rule] else [rule]
        if rules:
            self._last = rules[0]
            self._take_focus(rules)
            kinds = {effect.kind for effect in reaction.answer.effects}
            if not kinds & {"stayInScope", "stay"}:
                self._scope = [rule for rule in rules[-1].scope if rule.kind == "u"]
        for effect in reaction.answer.effects:
            self._carry_out(effect, rules[0].topic if rules else self.focus)

    def set_focus(self, name: str) -> None:
        """Give a topic the focus; one that is to be reset then is."""
        topic = self.topic(name)
        self.focus = name
        if topic is not None and "resetOnFocus" in topic.properties and not self._open_proposals(name):
            self._used -= set(topic.proposals)

    # --- what answers ask for ----------------------------------------------------------------------------------------

    def variable(self, name: str) -> str | None:
        return self._read(name) or None

    def concept(self, name: str) -> Sequence | None:
        return self.concepts.find(name, self.language, self._topics.values())

    def items(self, concept: str) -> list[str]:
        found = self.concept(concept)
        return [] if found is None else self.concepts.texts(found, self.concept)

    def tag_active(self, topic: str, tag: str) -> bool:
        return (topic, tag) not in self._inactive_tags

    def definition(self, topic: str, name: str) -> Definition | None:
        found = self.topic(topic)
        return None if found is None else found.definitions.get(name)

    def turn(self, key: tuple[str, int], count: int) -> int:
        return self._turns.get(key, 0) % count

    def took(self, key: tuple[str, int], index: int) -> None:
        self._turns[key] = index + 1

    def jump(self, function: str, topic: str, arguments: list[str]) -> Rule | None:
        first = arguments[0] if arguments else ""
        second = arguments[1] if len(arguments) > 1 else ""
        said = self._said.get(self.focus or topic, [])
        open_rules = self._open_proposals(first if function == "topic" else self.focus or topic)
        match function:
            case "previousProposal":
                return said[-2] if len(said) > 1 else None
            case "sameProposal":
                return said[-1] if said else None
            case "nextProposal" | "topic":
                return self._sayable(open_rules)
            case "topicRandom":
                rules = [rule for found in self.active for rule in self._open_proposals(found.name)]
                return self._random.choice(rules) if rules else None
            case "topicTag" | "topicTagReactivate":
                rules = self._rules_with(first, second)
            case _:
                rules = self._rules_with(topic, first)
        if not function.endswith("Reactivate"):
            rules = [rule for rule in rules if rule not in self._used]
        if function == "gotoRandom":
            return self._random.choice(rules) if rules else None
        return rules[0] if rules else None

    # --- inside ------------------------------------------------------------------------------------------------------

    def _first_of(self, events: list[str], understood: bool = True) -> Reaction | None:
        for event in events:
            reaction = self.react_to_event(event)
            if reaction is not None:
                reaction.understood = understood
                return reaction
        return None

    def _reaction(self, match: Match) -> Reaction | None:
        """Return what a matching rule says; what SpeakFailure says if it can say nothing."""
        maker = AnswerMaker(self, match.captures, self._random)
        try:
            answer = maker.make(match.rule)
        except Unsayable:
            event = Utterance.of("", [SPEAK_FAILURE])
            failure = self._best(event)
            return None if failure is None or failure.rule is match.rule else self._reaction(failure)
        answer.text = dressed(answer.text, self._skins(), self, self._random)
        answer.effects += self._learned(match)
        return Reaction(answer, [match.rule], match)

    def _said_of(self, rule: Rule) -> Reaction | None:
        try:
            return Reaction(AnswerMaker(self, {}, self._random).make(rule), [rule])
        except Unsayable:
            return None

    def _best(self, utterance: Utterance) -> Match | None:
        found: list[tuple[tuple, Match]] = []
        for group, rule in self._candidates():
            match = self._match(utterance, rule)
            if match is not None and not (utterance.words and not match.literal and rule.kind == "l"):
                hesitant = _has(rule, "lessPriority")
                rank = (not hesitant, match.complete, match.literal > 0, -group, match.literal)
                found.append((rank, match))
        self._utterance = utterance
        return max(found, key=lambda item: item[0])[1] if found else None

    def _match(self, utterance: Utterance, rule: Rule) -> Match | None:
        names = {
            name for (topic, name), path in self.renamed.items() if topic == rule.topic and path in utterance.events
        }
        if names:
            utterance = Utterance(utterance.text, utterance.words, utterance.spans, utterance.events | names)
        return Matcher(utterance, self).match(rule)

    def _candidates(self) -> Iterator[tuple[int, Rule]]:
        """Yield the rules that may answer, each with its group: scope, focus, others, fallback."""
        active = self.active
        names = {topic.name for topic in active}
        for rule in self._scope:
            if rule.topic in names:
                yield 0, rule
        for topic in active:
            group = 1 if topic.name == self.focus else 3 if "fallback" in topic.properties else 2
            for rule in topic.rules:
                if rule.kind == "u" and (group == 1 or "private" not in rule.properties):
                    yield group, rule

    def _learned(self, match: Match) -> list[Effect]:
        """Return what the learning rules cause that match what was said, too."""
        effects: list[Effect] = []
        for topic in self.active:
            for rule in topic.rules:
                if rule.kind == "l" and (learned := self._match(self._utterance, rule)) is not None:
                    try:
                        effects += AnswerMaker(self, learned.captures, self._random).make(rule).effects
                    except Unsayable:
                        continue
        return effects

    def _skins(self) -> list[Rule]:
        return [rule for topic in self.active for rule in topic.rules if rule.kind == "s"]

    def _open_proposals(self, name: str) -> list[Rule]:
        topic = self.topic(name)
        return [] if topic is None else [rule for rule in topic.proposals if rule not in self._used]

    def _sayable(self, rules: list[Rule]) -> Rule | None:
        """Return the first rule that none of its tags forbids."""
        return next((rule for rule in rules if all(self.tag_active(rule.topic, tag) for tag in rule.output_tags)), None)

    def _rules_with(self, name: str, tag: str) -> list[Rule]:
        topic = self.topic(name)
        return [] if topic is None else [rule for rule in topic.all_rules() if tag in rule.output_tags]

    def _take_focus(self, rules: list[Rule]) -> None:
        name = rules[-1].topic
        topic, holder = self.topic(name), self.topic(self.focus)
        if topic is None or name == self.focus or "noStay" in topic.properties:
            return
        if holder is not None and "keepFocus" in holder.properties and holder in self.active:
            return
        self.set_focus(name)

    def _carry_out(self, effect: Effect, topic: str) -> None:
        arguments = [argument for argument in effect.arguments if isinstance(argument, str)]
        match effect.kind, arguments:
            case "set", [name, value]:
                self._write(self.renamed.get((topic, name), name), value)
            case "clear", [name, *_]:
                self._write(name.lstrip("$"), "")
            case (("activate" | "deactivate"), [tag, *_]):
                self.set_tag(topic, tag, effect.kind == "activate")
            case "focus", [name]:
                self.set_focus(name)
            case "releaseFocus", _:
                self.focus, self._scope = "", []
            case (("addToConcept" | "removeFromConcept"), [name, item, *_]):
                change = self.concepts.add if effect.kind == "addToConcept" else self.concepts.discard
                change(name, self.language, [item])
            case "setUserInfo", [name, value]:
                self._write(f"user/{name}", value)
            case "removeUserInfo", [name, *_]:
                self._write(f"user/{name}", "")
            case (kind, arguments) if kind in REMEMBERING:
                self.knowledge(kind, arguments)
            case "clearConcept", [name, *_]:
                self.concepts.fill(name, self.language, [])


def _has(rule: Rule, function: str) -> bool:
    return rule.input is not None and any(
        isinstance(node, Function) and node.name == function for node in walk(rule.input)
    )
