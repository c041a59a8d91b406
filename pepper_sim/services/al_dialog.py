"""ALDialog: topics and language are stored; the simulated robot holds no conversation."""

from __future__ import annotations

from typing import Any

from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.naoqi.speech_languages import LANGUAGES


class ALDialog(Module):
    """Manages the dialogue's topics."""

    name = "ALDialog"

    def __init__(self) -> None:
        self._language = "English"
        self._topics: dict[str, str] = {}
        self._active: set[str] = set()
        self._subscribers: set[str] = set()
        self._focus = ""

    @remote("v(s)")
    def setLanguage(self, Language: str) -> None:
        """Sets the language."""
        self._language = one_of(Language, LANGUAGES, "Language")

    @remote("s()")
    def getLanguage(self) -> str:
        """Returns the language."""
        return self._language

    @remote("s(s)")
    def loadTopic(self, topicPath: str) -> str:
        """Loads a topic file from the robot's disk; there is none."""
        raise ServiceError(f"topic file '{shown(topicPath)[1:-1]}' was not found")

    @remote("s(s)")
    def loadTopicContent(self, topicContent: str) -> str:
        """Loads a topic from its text and returns its name."""
        words = topicContent.split()
        name = next((word.removeprefix("~") for word in words[1:] if word.startswith("~")), "")
        if not words or words[0] != "topic:" or not name.removesuffix("()"):
            raise ServiceError("topicContent must begin with 'topic: ~name()'")
        name = name.removesuffix("()")
        self._topics[name] = topicContent
        return name

    @remote("v(s)")
    def unloadTopic(self, topicName: str) -> None:
        """Unloads a topic."""
        self._topics.pop(self._known(topicName))
        self._active.discard(topicName)

    @remote("v(s)")
    def activateTopic(self, topicName: str) -> None:
        """Adds a topic to the dialogue."""
        self._active.add(self._known(topicName))

    @remote("v(s)")
    def deactivateTopic(self, topicName: str) -> None:
        """Removes a topic from the dialogue."""
        self._active.discard(self._known(topicName))

    @remote("[s]()")
    def getAllLoadedTopics(self) -> list[str]:
        """Lists the topics."""
        return sorted(self._topics)

    @remote("[s](s)")
    def getLoadedTopics(self, language: str) -> list[str]:
        """Lists the topics of a language."""
        return sorted(self._topics)

    @remote("[s]()")
    def getActivatedTopics(self) -> list[str]:
        """Lists the topics in the dialogue."""
        return sorted(self._active)

    @remote("v(s)")
    def setFocus(self, topicName: str) -> None:
        """Gives a topic priority."""
        self._focus = self._known(topicName)

    @remote("s()")
    def getFocus(self) -> str:
        """Returns the topic that has priority."""
        return self._focus

    @remote("v(s)")
    def subscribe(self, dialogName: str) -> None:
        """Starts the dialogue for a program."""
        self._subscribers.add(dialogName)

    @remote("v(s)")
    def unsubscribe(self, dialogName: str) -> None:
        """Ends the dialogue for a program."""
        self._subscribers.discard(dialogName)

    @remote("v()")
    def runDialog(self) -> None:
        """Starts the dialogue (older name)."""

    @remote("v()")
    def stopDialog(self) -> None:
        """Ends the dialogue (older name)."""

    @remote("v()")
    def resetAll(self) -> None:
        """Removes all topics and subscribers."""
        self._topics.clear()
        self._active.clear()
        self._subscribers.clear()

    @remote("v(ss[s])")
    def setConcept(self, conceptName: str, language: str, content: list[str]) -> None:
        """Fills a dynamic concept. Ignored."""

    @remote("v(s)")
    def forceInput(self, input: str) -> None:
        """Acts as if a sentence had been recognised. There is no engine to answer it."""

    @remote("v()")
    def forceOutput(self) -> None:
        """Makes the robot say its next proposal; it has none."""

    @remote("v(s)")
    def tell(self, sentence: str) -> None:
        """Acts as if a sentence had been recognised. There is no engine to answer it."""

    @remote("m(ss)")
    def getUserData(self, variable: str, user: str) -> Any:
        """Returns data about a user; there is none."""
        return None

    def _known(self, topic: str) -> str:
        if topic not in self._topics:
            raise ServiceError(f"topic '{shown(topic)[1:-1]}' is not loaded")
        return topic
