"""The topics that are loaded, in all languages, and those of them that are active."""

from __future__ import annotations

from pepper_sim.dialog.nodes import Topic


class Topics:
    """Loaded topics by language and name.

    Attributes:
        language: The present language; the topics of others stay silent.
    """

    def __init__(self) -> None:
        self.language = "English"
        self._topics: dict[tuple[str, str], Topic] = {}
        self._active: list[str] = []

    def add(self, topic: Topic) -> None:
        """Load a topic; one of the same name and language is replaced."""
        topic.language = topic.language or self.language
        self._topics[topic.language, topic.name] = topic

    def remove(self, name: str) -> None:
        """Unload a topic in all languages."""
        self.deactivate(name)
        for key in [key for key in self._topics if key[1] == name]:
            del self._topics[key]

    def loaded(self, language: str | None = None) -> list[str]:
        """List the names of the topics, of one language or of all."""
        return sorted(name for spoken, name in self._topics if language in (None, spoken))

    def activate(self, name: str) -> None:
        """Let a topic answer."""
        if name not in self._active:
            self._active.append(name)

    def deactivate(self, name: str) -> None:
        """Let a topic answer no more."""
        if name in self._active:
            self._active.remove(name)

    @property
    def active(self) -> list[Topic]:
        """The active topics in the present language, without those that another one replaces."""
        topics = [topic for name in self._active if (topic := self.topic(name)) is not None]
        replaced = {topic.overload for topic in topics}
        return [topic for topic in topics if topic.name not in replaced or topic.overload == topic.name]

    def topic(self, name: str) -> Topic | None:
        """Return a topic in the present language."""
        return self.find(name, self.language)

    def find(self, name: str, language: str) -> Topic | None:
        """Return a topic in a language."""
        return self._topics.get((language, name))

    def static_concepts(self) -> set[str]:
        """Names of the concepts that topics define, which cannot be changed."""
        return {name for topic in self._topics.values() for name in topic.concepts}
