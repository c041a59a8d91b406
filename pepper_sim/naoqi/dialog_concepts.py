"""The dynamic concepts of ALDialog: lists of words that programs fill."""

from __future__ import annotations

import threading

from pepper_sim.dialog.conversation import Conversation
from pepper_sim.naoqi.dialog_settings import known_language
from pepper_sim.naoqi.service import ServiceError, remote


class DialogConcepts:
    """Remote methods of ALDialog; `lock` is held while the conversation is changed."""

    def __init__(self, conversation: Conversation, lock: threading.RLock) -> None:
        self._conversation = conversation
        self._lock = lock

    @remote("v(ss[s])")
    def setConcept(self, conceptName: str, language: str, content: list[str]) -> None:
        """Fills a dynamic concept."""
        with self._lock:
            self._conversation.concepts.fill(self._dynamic(conceptName), known_language(language), content)

    @remote("v(ss[s])")
    def addToConcept(self, conceptName: str, language: str, content: list[str]) -> None:
        """Adds to a dynamic concept."""
        with self._lock:
            self._conversation.concepts.add(self._dynamic(conceptName), known_language(language), content)

    @remote("[s](ss)")
    def getConcept(self, conceptName: str, language: str) -> list[str]:
        """Lists what a dynamic concept holds."""
        return self._conversation.concepts.content(conceptName, known_language(language))

    @remote("v()")
    def clearConcepts(self) -> None:
        """Empties all dynamic concepts."""
        with self._lock:
            self._conversation.concepts.clear()

    def _dynamic(self, concept: str) -> str:
        """Check that a concept may be changed: that no topic defines it as a static one."""
        if concept in self._conversation.static_concepts():
            raise ServiceError(f"concept '{concept}' is static; only those declared with 'dynamic:' can be changed")
        return concept
