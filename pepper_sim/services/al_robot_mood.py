"""ALRobotMood: how the robot feels: pleased by strokes on its head and by smiles, excited by what moves around it.

It works while autonomous life does, once a second. Source: NAOqi 2.8 documentation, ALRobotMood; how much each of these
counts is a choice of this simulation.
"""

from __future__ import annotations

from typing import Any

from pepper_sim.naoqi.people.population import Look, Population
from pepper_sim.naoqi.service import Service, remote
from pepper_sim.services.al_autonomous_life import ALAutonomousLife
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_mood import ALMood
from telepresence.naoqi.signals import Property, Signal

PERIOD = 1.0
STROKE, FADING = 0.5, 0.9
"""What a stroke adds to the pleasure, and which share of it is left after a second."""
SMILES = 0.6
"""Share of the focused user's valence that the robot feels too."""
PLEASED, EXCITED = 0.3, 0.5
_VALUE = "(ff)<ValueConfidence,value,confidence>"
_FULL = f"({_VALUE}{_VALUE})<RobotFullState,pleasure,excitement>"
_SIMPLE = "(ss)<RobotState,pleasure,excitement>"
_SURE = 1.0


class ALRobotMood(Service):
    """Keeps the robot's mood."""

    name = "ALRobotMood"

    def __init__(self, memory: ALMemory, population: Population, mood: ALMood, life: ALAutonomousLife) -> None:
        self._mood = mood
        self._life = life
        self._strokes = self._pleasure = self._excitement = 0.0
        self._due = 0.0
        self.fullState, self.state = Property(_FULL), Property(_SIMPLE)
        self.pleasure, self.excitement = Property("s"), Property("s")
        self.stateChanged = Signal(f"({_SIMPLE})")
        self.pleasureChanged, self.excitementChanged = Signal("(s)"), Signal("(s)")
        self._publish()
        memory.follow("TouchChanged", self._touched)
        population.watch(life.is_on, self._update, tracks=False)

    @remote(f"{_FULL}()")
    def getFullState(self) -> tuple:
        """Returns pleasure (-1 to 1) and excitement (0 to 1), and how sure they are."""
        return (self._pleasure, _SURE), (self._excitement, _SURE)

    @remote(f"{_SIMPLE}()")
    def getState(self) -> tuple[str, str]:
        """Returns negative, neutral or positive, and calm or excited."""
        word = "positive" if self._pleasure > PLEASED else "negative" if self._pleasure < -PLEASED else "neutral"
        return word, "excited" if self._excitement > EXCITED else "calm"

    def _touched(self, changes: Any) -> None:
        if self._life.is_on() and any(name.startswith("Head") and pressed for name, pressed in changes):
            self._strokes = min(1.0, self._strokes + STROKE)

    def _update(self, look: Look) -> None:
        if look.sight.time < self._due:
            return
        self._due = look.sight.time + PERIOD
        valence, sure = self._mood.focused_valence()
        self._pleasure = max(-1.0, min(1.0, self._strokes + SMILES * valence * sure))
        self._excitement = self._mood.agitation
        self._strokes *= FADING
        self._publish()

    def _publish(self) -> None:
        before, (pleasure, excitement) = (self.pleasure.value(), self.excitement.value()), self.getState()
        self.fullState.setValue(self.getFullState())
        self.state.setValue((pleasure, excitement))
        self.pleasure.setValue(pleasure)
        self.excitement.setValue(excitement)
        if pleasure != before[0]:
            self.pleasureChanged(pleasure)
        if excitement != before[1]:
            self.excitementChanged(excitement)
        if (pleasure, excitement) != before:
            self.stateChanged((pleasure, excitement))
