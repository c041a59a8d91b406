"""Skins: s:(answer) ^addword(text, position, probability) and ^replace(old, new, probability) change what is said."""

from __future__ import annotations

import random
import re

from pepper_sim.dialog.matching import Context, Matcher, Utterance
from pepper_sim.dialog.nodes import Function, Rule, walk


def dressed(text: str, skins: list[Rule], context: Context, random_numbers: random.Random) -> str:
    """Return an answer after the skins that match it."""
    for skin in skins:
        match = Matcher(Utterance.of(text), context).match(skin)
        if match is None:
            continue
        for node in walk(skin.output):
            if isinstance(node, Function) and node.name in ("addword", "replace") and len(node.texts) == 3:
                first, second, probability = node.texts
                if random_numbers.random() < _number(probability):
                    change = _added if node.name == "addword" else _replaced
                    text = change(text, first, second)
    return text


def _added(text: str, words: str, position: str) -> str:
    parts = text.split()
    at = 0 if position == "start" else len(parts) if position == "end" else max(0, int(_number(position)) - 1)
    return " ".join([*parts[:at], words, *parts[at:]])


def _replaced(text: str, old: str, new: str) -> str:
    return re.sub(rf"\b{re.escape(old)}\b", lambda _: new, text, flags=re.IGNORECASE)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
