"""Grammars of the speech recognition: BNF text, as the documentation of NAOqi's ALSpeechRecognition has it.

#BNF+EM V1.1;                  "#BNF..." and "!grammar", "!language" only name things
!grammar lights;
!start <command>;              rules that are listened for
!activatable <colour>;         rules that can be switched off
!slot <name>;                  rules that programs fill
<command>: switch !optional(please) the (light | lamp) <colour>;
<colour>: red | green;
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from pepper_sim.dialog.nodes import Choice, Concept, Node, Optional, Repeat, Sequence, TopicError, Word

MAX_DEPTH = 40
_TOKEN = re.compile(r'\s+|//[^\n]*|"[^"\n]*"|<[^<>\n]+>|![A-Za-z]+|[;:|()]|[^\s;:|()<>"!]+|.')


@dataclass
class Grammar:
    """A grammar: its rules, and which of them are listened for, switched off, or filled by programs."""

    name: str = ""
    rules: dict[str, Sequence] = field(default_factory=dict)
    start: list[str] = field(default_factory=list)
    activatable: list[str] = field(default_factory=list)
    slots: list[str] = field(default_factory=list)


def read_grammar(text: str) -> Grammar:
    """Read a grammar.

    Raises: TopicError: It is none; the text names line and column.
    """
    return _GrammarReader(text).read()


class _GrammarReader:
    def __init__(self, text: str) -> None:
        self._text = re.sub(r"^\s*#BNF[^;]*;", lambda match: re.sub(r"[^\n]", " ", match.group()), text)
        found = _TOKEN.finditer(self._text)
        self._tokens = [match for match in found if not match.group().isspace() and not match.group().startswith("//")]
        self._at = 0

    def read(self) -> Grammar:
        grammar = Grammar()
        while self._at < len(self._tokens):
            token = self._next()
            if token.startswith("!"):
                self._declaration(grammar, token)
            elif token.startswith("<"):
                self._expect(":")
                grammar.rules[token[1:-1]] = self._alternatives(0)
            else:
                raise self._error(f"a rule '<name>:' or a declaration is expected, not {token!r}")
            self._expect(";")
        missing = [name for name in grammar.start if name not in grammar.rules]
        if not grammar.start or missing:
            text = f"rule <{missing[0]}> is not defined" if missing else "'!start <rule>;' is missing"
            raise TopicError(text, 1, 1)
        return grammar

    def _declaration(self, grammar: Grammar, word: str) -> None:
        lists = {"!start": grammar.start, "!activatable": grammar.activatable, "!slot": grammar.slots}
        while self._peek() not in (";", ""):
            token = self._next()
            if token.startswith("<") and word in lists:
                lists[word].append(token[1:-1])
            elif word == "!grammar":
                grammar.name = token.strip('"')
        for name in grammar.slots:
            grammar.rules.setdefault(name, Sequence((Choice((), "next", 0),)))

    def _alternatives(self, depth: int) -> Sequence:
        if depth > MAX_DEPTH:
            raise self._error(f"more than {MAX_DEPTH} parentheses are nested")
        choices: list[Node] = []
        items: list[Node] = []
        while self._peek() not in (";", ")", ""):
            if self._peek() == "|":
                self._next()
                choices.append(Sequence(tuple(items)))
                items = []
            else:
                items.append(self._item(depth))
        choices.append(Sequence(tuple(items)))
        return Sequence((Choice(tuple(choices), "next", 0),)) if len(choices) > 1 else Sequence(tuple(items))

    def _item(self, depth: int) -> Node:
        token = self._next()
        if token == "(":
            inside = self._alternatives(depth + 1)
            self._expect(")")
            return inside
        if token in ("!optional", "!repeat"):
            self._expect("(")
            inside = self._alternatives(depth + 1)
            self._expect(")")
            return Optional((inside,), 0) if token == "!optional" else Repeat((inside,))
        if token.startswith("<"):
            return Concept(token[1:-1], 0)
        if token in (":", "!") or token.startswith("!"):
            raise self._error(f"{token!r} is not expected here")
        return Word(token.strip('"'))

    def _peek(self) -> str:
        return self._tokens[self._at].group() if self._at < len(self._tokens) else ""

    def _next(self) -> str:
        token = self._peek()
        self._at += 1
        return token

    def _expect(self, wanted: str) -> None:
        if self._peek() != wanted:
            raise self._error(f"'{wanted}' is missing")
        self._next()

    def _error(self, text: str) -> TopicError:
        index = min(self._at, len(self._tokens)) - (self._at >= len(self._tokens))
        at = self._tokens[index].start() if self._tokens and index >= 0 else 0
        line = self._text.count("\n", 0, at) + 1
        return TopicError(text, line, at - (self._text.rfind("\n", 0, at) + 1) + 1)
