"""QiChat's functions about knowledge, carried out by ALKnowledge: ^addKnowledge(bob, likes, blue) and so on."""

from __future__ import annotations

from pepper_sim.naoqi.service import ServiceError
from pepper_sim.services.al_knowledge import LEARNING, ALKnowledge

_METHODS = {
    "addKnowledge": ("add", 3),
    "updateKnowledge": ("update", 3),
    "removeKnowledge": ("remove", 3),
    "containsKnowledge": ("contains", 3),
    "queryKnowledge": ("query", 3),
    "addMetadata": ("addMetadata", 5),
    "updateMetadata": ("updateMetadata", 5),
    "removeMetadata": ("removeMetadata", 5),
    "containsMetadata": ("containsMetadata", 5),
    "queryMetadata": ("queryMetadata", 4),
    "getKnowledgeId": ("getId", 3),
}
"""Function of QiChat -> method of ALKnowledge, number of arguments."""


class DialogKnowledge:
    """Calls ALKnowledge for rules; "?" stands for everything."""

    def __init__(self, knowledge: ALKnowledge) -> None:
        self._knowledge = knowledge

    def __call__(self, function: str, arguments: list[str]) -> str | None:
        """Return the first of what is found, "" for a plain yes, None for nothing or a call that is refused."""
        method, count = _METHODS[function]
        if len(arguments) != count:
            return None
        anything = "?" if function == "queryKnowledge" else "*"
        wanted = [anything if argument == "?" else argument for argument in arguments]
        try:
            found = getattr(self._knowledge, method)(LEARNING, *wanted)
        except ServiceError:
            return None
        if isinstance(found, list):
            return str(found[0]) if found else None
        if isinstance(found, bool):
            return "" if found else None
        return "" if found is None else str(found)
