"""The contexts of ALSpeechRecognition: grammars on the robot's disk, with rules that can be switched and filled."""

from __future__ import annotations

import copy

from pepper_sim.dialog.grammar import Grammar, read_grammar
from pepper_sim.dialog.matching import Matcher, Utterance, words_of
from pepper_sim.dialog.nodes import Choice, Function, Rule, Sequence, TopicError, Word
from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import ServiceError, one_of, remote, shown
from pepper_sim.naoqi.speech_languages import LANGUAGES

MAX_CHARACTERS = 500_000
MAX_CONTEXTS = 100
COMPILED = "LCF\n"
"""First line of a compiled grammar. A robot's is binary; ours is the text of the grammar."""
RULE_TYPES = ("start", "active", "activatable", "slot")


class _Context:
    """One grammar, and its rules that are switched off."""

    def __init__(self, grammar: Grammar) -> None:
        self.grammar = grammar
        self.inactive: set[str] = set()

    def rules(self, kind: str) -> list[str]:
        grammar = self.grammar
        if kind == "active":
            return [name for name in grammar.rules if name not in self.inactive]
        return {"start": grammar.start, "activatable": grammar.activatable, "slot": grammar.slots}[kind]

    # What `Matcher` asks for.

    def variable(self, name: str) -> str | None:
        return None

    def concept(self, name: str) -> Sequence | None:
        return None if name in self.inactive else self.grammar.rules.get(name)

    def tag_active(self, topic: str, tag: str) -> bool:
        return True

    def matches(self, text: str) -> bool:
        """Whether a start rule stands for exactly this text."""
        exact = Function("exact", (), "")
        for name in self.grammar.start:
            content = self.concept(name)
            if content is not None:
                rule = Rule("u", 0, Sequence((*content.items, exact)), Sequence(), name, 0)
                if Matcher(Utterance.of(text), self).match(rule) is not None:
                    return True
        return False


class RecognitionContexts:
    """Remote methods of ALSpeechRecognition about grammars."""

    def __init__(self, disk: RobotDisk) -> None:
        self._disk = disk
        self._contexts: dict[str, _Context] = {}
        self._saved: dict[str, dict[str, _Context]] = {}

    def results(self, text: str) -> list[tuple[str, str]]:
        """Return what was said, once for every context that it matches, with the context's name."""
        spoken = " ".join(words_of(text))
        return [(spoken, name) for name, context in self._contexts.items() if context.matches(text)]

    def only(self, path: str) -> None:
        """Listen for one grammar of the robot's disk only."""
        context = self._load(path)
        self._contexts = {"loadVocabulary": context}

    def clear(self) -> None:
        """Remove all contexts."""
        self._contexts = {}

    @remote("v(sss)")
    def compile(self, pathToInputBNFFile: str, pathToOutputLCFFile: str, language: str) -> None:
        """Converts a grammar of the robot's disk into the form that addContext takes."""
        one_of(language, LANGUAGES, "language")
        text = self._text(pathToInputBNFFile)
        self._grammar(text, pathToInputBNFFile)
        target = self._disk.output(pathToOutputLCFFile)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(COMPILED + text, encoding="utf-8")

    @remote("v(ss)")
    def addContext(self, pathToLCFFile: str, contextName: str) -> None:
        """Listens for a compiled grammar, too."""
        if len(self._contexts) >= MAX_CONTEXTS:
            raise ServiceError(f"there are {MAX_CONTEXTS} contexts already")
        self._contexts[contextName] = self._load(pathToLCFFile)

    @remote("v(s)")
    def removeContext(self, contextName: str) -> None:
        """Listens for a grammar no more."""
        self._known(contextName)
        del self._contexts[contextName]

    @remote("v(s)")
    def saveContextSet(self, saveName: str) -> None:
        """Remembers the present contexts under a name."""
        if len(self._saved) >= MAX_CONTEXTS and saveName not in self._saved:
            raise ServiceError(f"{MAX_CONTEXTS} sets of contexts are saved already")
        self._saved[saveName] = dict(self._contexts)

    @remote("v(s)")
    def loadContextSet(self, saveName: str) -> None:
        """Goes back to remembered contexts, with what was changed in them since."""
        self._contexts = dict(self._saved[one_of(saveName, self._saved, "saveName")])

    @remote("v(s)")
    def eraseContextSet(self, saveName: str) -> None:
        """Forgets remembered contexts."""
        del self._saved[one_of(saveName, self._saved, "saveName")]

    @remote("v(ss)")
    def activateRule(self, contextName: str, ruleName: str) -> None:
        """Switches a rule on."""
        self._switch(contextName, ruleName, True)

    @remote("v(ss)")
    def deactivateRule(self, contextName: str, ruleName: str) -> None:
        """Switches a rule off."""
        self._switch(contextName, ruleName, False)

    @remote("v(s)")
    def activateAllRules(self, contextName: str) -> None:
        """Switches all rules of a context on."""
        self._known(contextName).inactive.clear()

    @remote("v(s)")
    def deactivateAllRules(self, contextName: str) -> None:
        """Switches off all rules of a context that can be switched."""
        context = self._known(contextName)
        context.inactive.update(context.grammar.activatable)

    @remote("v(ss[s])")
    def addWordListToSlot(self, contextName: str, slotName: str, wordList: list[str]) -> None:
        """Adds phrases to a slot."""
        grammar = self._known(contextName).grammar
        present = grammar.rules[one_of(slotName, grammar.slots, "slotName")].items[0]
        items = present.items if isinstance(present, Choice) else ()
        grammar.rules[slotName] = Sequence((Choice((*items, *(Word(text) for text in wordList)), "next", 0),))

    @remote("v(ss)")
    def removeWordListFromSlot(self, contextName: str, slotName: str) -> None:
        """Empties a slot."""
        grammar = self._known(contextName).grammar
        grammar.rules[one_of(slotName, grammar.slots, "slotName")] = Sequence((Choice((), "next", 0),))

    @remote("[s](ss)")
    def getRules(self, contextName: str, typeName: str) -> list[str]:
        """Lists the rules of a context: "start", "active", "activatable" or "slot"."""
        return list(self._known(contextName).rules(one_of(typeName, RULE_TYPES, "typeName")))

    # --- inside ------------------------------------------------------------------------------------------------------

    def _known(self, name: str) -> _Context:
        return self._contexts[one_of(name, self._contexts, "contextName")]

    def _switch(self, context_name: str, rule: str, active: bool) -> None:
        context = self._known(context_name)
        one_of(rule, context.grammar.activatable, "ruleName")
        (context.inactive.discard if active else context.inactive.add)(rule)

    def _load(self, name: str) -> _Context:
        text = self._text(name)
        if not text.startswith(COMPILED):
            raise ServiceError(f"'{shown(name)[1:-1]}' is no compiled grammar; compile it first")
        return _Context(copy.copy(self._grammar(text.removeprefix(COMPILED), name)))

    def _text(self, name: str) -> str:
        path = self._disk.path(name)
        if not path.is_file():
            raise ServiceError(f"file '{shown(name)[1:-1]}' was not found")
        if path.stat().st_size > MAX_CHARACTERS:
            raise ServiceError(f"'{shown(name)[1:-1]}' has more than {MAX_CHARACTERS} bytes")
        try:
            return path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            raise ServiceError(f"'{shown(name)[1:-1]}' is no grammar") from None

    def _grammar(self, text: str, name: str) -> Grammar:
        try:
            return read_grammar(text)
        except TopicError as error:
            raise ServiceError(f"{shown(name)[1:-1]}: {error}") from None
