"""ALMood: how the person whom the robot deals with feels, and how lively the surroundings are.

It works while autonomous life does, once a second, from the face that the robot sees: smile and expression give the
valence, the turn of the head the attention. Ambiance is how fast the people in view move; sound does not count here.
Source: NAOqi 2.8 documentation, ALMood.
"""

from __future__ import annotations

import concurrent.futures
import math
from typing import Any

from pepper_sim.body.people_sight import SeenPerson
from pepper_sim.naoqi.people.population import Known, Look, Population
from pepper_sim.naoqi.service import Service, remote
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.services.al_autonomous_life import ALAutonomousLife
from pepper_sim.services.al_face_characteristics import confidence
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_user_session import ALUserSession
from telepresence.naoqi.signals import Property, Signal

PERIOD = 1.0
"""The mood is estimated this often [s]."""
SURE = 0.4
"""Estimates that are less sure are not reported."""
SEMI_ENGAGED, FULLY_ENGAGED = 0.6, 0.9
"""Attention from which on somebody is engaged."""
REACTION_TIME = 3.0
POSITIVE = 0.25
"""Valence from which on a mood is positive, or below its negative, negative; no document gives it."""
ASIDE = math.radians(12.0)
"""A head turned by more than this looks elsewhere [rad]."""
_LIVELY = 1.0
_VALUE = "(ff)<ValueConfidence,value,confidence>"
_BODY = "((ff)<LevelConfidence,level,confidence>)<BodyLanguageState,ease>"
_EXPRESSIONS = f"({7 * _VALUE})<Expressions,calm,anger,joy,sorrow,laughter,excitement,surprise>"
_FIELDS = "valence,attention,bodyLanguageState,smile,expressions"
PERSON_STATE = f"({_VALUE}{_VALUE}{_BODY}{_VALUE}{_EXPRESSIONS})<PersonState,{_FIELDS}>"
AMBIANCE = "(ff)<AmbianceState,agitationLevel,calmLevel>"
_NOTHING = (0.0, 0.0)
_NO_STATE = (_NOTHING, _NOTHING, (_NOTHING,), _NOTHING, (_NOTHING,) * 7)


class ALMood(Service):
    """Estimates moods."""

    name = "ALMood"

    def __init__(
        self,
        memory: ALMemory,
        population: Population,
        workers: Workers,
        sessions: ALUserSession,
        life: ALAutonomousLife,
    ) -> None:
        self._population = population
        self._workers = workers
        self._sessions = sessions
        self._life = life
        self._subscribers: dict[str, str] = {}
        self._due = 0.0
        self._places: dict[int, tuple[float, tuple[float, float, float]]] = {}
        self._agitation = 0.0
        self.valence, self.attention, self.ambiance = Property("s"), Property("s"), Property("s")
        self.valenceLevel, self.attentionLevel, self.ambianceLevel = Property(_VALUE), Property(_VALUE), Property("f")
        self.attentionZone = Property("s")
        self.valenceChanged, self.attentionChanged = Signal("(s)"), Signal("(s)")
        self.ambianceChanged, self.currentFocusedUserMood = Signal("(s)"), Signal("(s)")
        self.attentionZone.setValue("Unknown")
        self.ambiance.setValue("calm")
        population.watch(life.is_on, self._update)

    @remote(f"{PERSON_STATE}()")
    def currentPersonState(self) -> tuple:
        """Returns the mood of the focused user; all zero if there is none or autonomous life is off."""
        return self.personStateFromUserSession(self._sessions.getFocusedUser())

    @remote(f"{PERSON_STATE}(I)")
    def personStateFromPeoplePerception(self, ID: int) -> tuple:
        """Returns the mood of a person of PeopleList; all zero for nobody."""
        return self._state(self._population.find(ID))

    @remote(f"{PERSON_STATE}(I)")
    def personStateFromUserSession(self, ID: int) -> tuple:
        """Returns the mood of a user; all zero for nobody."""
        return self._state(self._population.find(self._sessions.getPpidFromUsid(ID)))

    @remote(f"[(I{PERSON_STATE})<Person,userSessionID,personState>]()", name="persons")
    def moodsOfUsers(self) -> list[tuple]:
        """Lists the users with their moods."""
        return [(user, self.personStateFromUserSession(user)) for user in self._sessions.getUserList()]

    @remote(f"{AMBIANCE}()")
    def ambianceState(self) -> tuple[float, float]:
        """Returns how agitated and how calm the surroundings are, 0 to 1."""
        return self._agitation, 1.0 - self._agitation

    @remote("s()")
    def getEmotionalReaction(self) -> concurrent.futures.Future:
        """Returns the focused user's first positive or negative reaction within 3 s, else "neutral" or "unknown"."""
        return self._workers.run(self._wait_for_reaction)

    @remote("b(ss)")
    def subscribe(self, subscribedName: str, operatingMode: str) -> bool:
        """Has no effect: autonomous life switches this service (deprecated)."""
        self._subscribers[subscribedName] = operatingMode
        return operatingMode in ("Active", "Passive")

    @remote("b(s)")
    def unsubscribe(self, subscribedName: str) -> bool:
        """Removes a subscriber (deprecated)."""
        return self._subscribers.pop(subscribedName, None) is not None

    @remote("{ss}()")
    def getSubscribersInfo(self) -> dict[str, str]:
        """Returns subscriber -> mode (deprecated)."""
        return dict(self._subscribers)

    # --- for the other services --------------------------------------------------------------------------------------

    @property
    def agitation(self) -> float:
        """How fast people in view move, 0 to 1."""
        return self._agitation

    def focused_valence(self) -> tuple[float, float]:
        """Return the focused user's valence, -1 to 1, and how sure it is."""
        return self.currentPersonState()[0]

    # --- inside ------------------------------------------------------------------------------------------------------

    def _state(self, known: Known | None) -> tuple:
        if known is None or not known.visible or not self._life.is_on() or known.last.face is None:
            return _NO_STATE
        seen = known.last
        sure = confidence(known.last.face)
        smile = seen.figure.smile
        attention = _attention(seen)
        expressions = (
            (1.0 - smile, sure),
            (0.0, sure),
            (smile, sure),
            (0.0, sure),
            (0.0, sure),
            (0.0, sure),
            (0.0, sure),
        )
        return ((smile, sure), (attention, sure), ((attention, 0.5 * sure),), (smile, sure), expressions)

    def _update(self, look: Look) -> None:
        if look.sight.time < self._due:
            return
        self._due = look.sight.time + PERIOD
        self._measure_agitation(look)
        (valence, sure), (attention, certain), *_ = self.currentPersonState()
        self.valenceLevel.setValue((valence, sure))
        self.attentionLevel.setValue((attention, certain))
        self.ambianceLevel.setValue(self._agitation)
        word = _valence_word(valence) if sure > SURE else ""
        _change(self.valence, word, self.valenceChanged)
        self.currentFocusedUserMood(word or "unknown")
        engaged = "fullyEngaged" if attention >= FULLY_ENGAGED else "semiEngaged"
        engaged = engaged if attention >= SEMI_ENGAGED else "unengaged"
        _change(self.attention, engaged if certain > SURE else "", self.attentionChanged)
        _change(self.ambiance, "excited" if self._agitation > 0.5 else "calm", self.ambianceChanged)
        known = self._population.find(self._sessions.getPpidFromUsid(self._sessions.getFocusedUser()))
        self.attentionZone.setValue(_zone(known.last) if known and certain > SURE else "Unknown")

    def _measure_agitation(self, look: Look) -> None:
        fastest, places = 0.0, {}
        for known in look.visible:
            now, place = look.sight.time, known.last.in_world
            before = self._places.get(known.number)
            if before is not None and now > before[0]:
                fastest = max(fastest, math.dist(place, before[1]) / (now - before[0]))
            places[known.number] = (now, place)
        self._places = places
        self._agitation = min(1.0, fastest / _LIVELY)

    def _wait_for_reaction(self) -> str:
        found = {"word": "unknown"}

        def reacted() -> bool:
            valence, sure = self.focused_valence()
            if sure > SURE:
                found["word"] = _valence_word(valence)
            return found["word"] in ("positive", "negative") or not self._life.is_on()

        self._workers.wait_until(reacted, REACTION_TIME, 0.1)
        return found["word"]


def _change(held: Property, value: str, changed: Signal) -> None:
    before: Any = held.value()
    held.setValue(value)
    if value and value != before:
        changed(value)


def _valence_word(valence: float) -> str:
    return "positive" if valence > POSITIVE else "negative" if valence < -POSITIVE else "neutral"


def _attention(seen: SeenPerson) -> float:
    """Return 1 for somebody who looks straight at the robot, 0 for one who does not at all."""
    if seen.face is None:
        return 0.0
    return max(0.0, 1.0 - max(0.0, math.hypot(*seen.face.turn[:2]) - 0.5 * ASIDE) / math.radians(50.0))


def _zone(seen: SeenPerson) -> str:
    """Return where somebody looks, left and right as the person sees them."""
    if seen.face is None:
        return "Unknown"
    yaw, pitch, _ = seen.face.turn
    vertical = "Down" if pitch > ASIDE else "Up" if pitch < -ASIDE else ""
    horizontal = "Left" if yaw > ASIDE else "Right" if yaw < -ASIDE else ""
    return f"Looking{vertical}{horizontal}" if vertical or horizontal else "LookingAtRobot"
