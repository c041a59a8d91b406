"""The settings of ALDialog: confidences, movement while the robot answers, events, and its memory of users."""

from __future__ import annotations

import time
from typing import Any

from pepper_sim.dialog.reader import language_name
from pepper_sim.naoqi.dialog_turns import DialogTurns
from pepper_sim.naoqi.dialog_users import DialogUsers
from pepper_sim.naoqi.service import ServiceError, one_of, remote, shown, within
from pepper_sim.naoqi.speech_languages import LANGUAGES
from pepper_sim.services.al_memory import ALMemory

GRAMMARS = ("BNF", "SLM", "REMOTE")
THRESHOLD = 0.5
"""Confidence that a recognised sentence must have, until a program changes it."""


def known_language(language: str) -> str:
    """Return NAOqi's name of a language, given its name or QiChat's code.

    Raises: ServiceError: The robot does not speak it.
    """
    name: str = one_of(language_name(language) or language, LANGUAGES, "language")
    return name


class DialogSettings:
    """Remote methods of ALDialog.

    Attributes:
        language: Language of the dialogue.
        speech: Configuration of ALAnimatedSpeech for answers; [] for its general one.
        talking_since: When a human spoke last, or a session began [s, monotonic].
    """

    def __init__(self, memory: ALMemory, turns: DialogTurns, users: DialogUsers) -> None:
        self.language = "English"
        self.speech: Any = []
        self.talking_since = time.monotonic()
        self._memory = memory
        self._turns = turns
        self._users = users
        self._thresholds: dict[tuple[str, str], float] = {}

    # --- confidence and speech ---------------------------------------------------------------------------------------

    @remote("v(sf)", "v(sfs)")
    def setConfidenceThreshold(self, grammar: str, threshold: float, language: str = "") -> None:
        """Sets the confidence that a recognised sentence must have, 0 to 1, for one language or for all."""
        one_of(grammar, GRAMMARS, "grammar")
        within(threshold, 0.0, 1.0, "threshold")
        for name in [known_language(language)] if language else LANGUAGES:
            self._thresholds[grammar, name] = threshold

    @remote("f(ss)")
    def getConfidenceThreshold(self, grammar: str, language: str) -> float:
        """Returns the confidence that a recognised sentence must have."""
        return self._thresholds.get((one_of(grammar, GRAMMARS, "grammar"), known_language(language)), THRESHOLD)

    @remote("{s{sf}}()")
    def getAllConfidenceThresholds(self) -> dict[str, dict[str, float]]:
        """Returns the confidences, by grammar and language."""
        return {
            grammar: {language: self.getConfidenceThreshold(grammar, language) for language in LANGUAGES}
            for grammar in GRAMMARS
        }

    @remote("v()")
    def removeAllLanguageThresholds(self) -> None:
        """Sets the confidences back to their default."""
        self._thresholds.clear()

    @remote("v(f)")
    def setASRConfidenceThreshold(self, threshold: float) -> None:
        """Older name of setConfidenceThreshold for the BNF grammar."""
        self.setConfidenceThreshold("BNF", threshold)

    @remote("f()")
    def getASRConfidenceThreshold(self) -> float:
        """Older name of getConfidenceThreshold for the BNF grammar in the present language."""
        return self.getConfidenceThreshold("BNF", self.language)

    @remote("v(m)")
    def setAnimatedSpeechConfiguration(self, animatedSpeechConfiguration: Any) -> None:
        """Sets how the robot moves while it answers, as for ALAnimatedSpeech.say; [] for the general setting."""
        if not isinstance(animatedSpeechConfiguration, dict | list | tuple):
            raise ServiceError(f"animatedSpeechConfiguration must be a map, got {shown(animatedSpeechConfiguration)}")
        self.speech = animatedSpeechConfiguration

    @remote("m()")
    def getAnimatedSpeechConfiguration(self) -> Any:
        """Returns how the robot moves while it answers: [[name, value], ...]."""
        configuration = self.speech
        return [list(pair) for pair in (configuration.items() if isinstance(configuration, dict) else configuration)]

    # --- events ------------------------------------------------------------------------------------------------------

    @remote("v(si)")
    def setDelay(self, eventName: str, validity: int) -> None:
        """Sets how long an event waits while the robot speaks [ms]; -1 for ever."""
        if validity < -1:
            raise ServiceError(f"validity must be -1 or more, got {validity}")
        self._turns.validities[eventName] = validity / 1000.0

    @remote("v(s)")
    def addBlockingEvent(self, eventName: str) -> None:
        """Lets an event interrupt what the robot says."""
        self._turns.blocking.add(eventName)

    @remote("v(s)")
    def removeBlockingEvent(self, eventName: str) -> None:
        """Lets an event wait until the robot has spoken."""
        self._turns.blocking.discard(eventName)

    # --- users -------------------------------------------------------------------------------------------------------

    @remote("v(i)")
    def openSession(self, id: int) -> None:
        """Begins to talk with a user, whose variables go into ALMemory."""
        self._users.open(id)
        self.talking_since = time.monotonic()
        self._memory.announce("Dialog/OpenSession", id)

    @remote("v()")
    def closeSession(self) -> None:
        """Ends the talk with a user, whose variables are kept."""
        self._users.close()

    @remote("[s]()")
    def getUserList(self) -> list[str]:
        """Lists the numbers of the users of whom something is known."""
        return self._users.known()

    @remote("v(ssi)")
    def insertUserData(self, variableName: str, variableValue: str, userID: int) -> None:
        """Remembers a variable of a user."""
        self._users.insert(variableName, variableValue, userID)

    @remote("s(si)")
    def getUserData(self, variableName: str, userID: int) -> str:
        """Returns a variable of a user; "" if it is not known."""
        return self._users.of(userID).get(variableName, "")

    @remote("[s](i)")
    def getUserDataList(self, userID: int) -> list[str]:
        """Lists the variables of a user."""
        return sorted(self._users.of(userID))
