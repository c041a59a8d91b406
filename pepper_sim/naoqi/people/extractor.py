"""PeopleExtractor: an extractor that adds something to what is known of the people around the robot."""

from __future__ import annotations

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.people.population import Look, Population
from pepper_sim.services.al_memory import ALMemory


class PeopleExtractor(Extractor):
    """Base of the extractors of people: `update` is called after every look, no more often than subscribers want."""

    def __init__(self, memory: ALMemory, population: Population) -> None:
        super().__init__(memory)
        self._population = population
        self._due = 0.0
        population.watch(lambda: self.active, self._look)

    def update(self, look: Look) -> None:
        """Write keys and raise events for what was seen. A subclass does."""

    def _look(self, look: Look) -> None:
        if look.sight.time >= self._due:
            self._due = look.sight.time + 1e-3 * self.getCurrentPeriod() - 0.5 * _SLACK
            self.update(look)


_SLACK = 0.05
"""The looks of a slower subscriber need not fall on its period exactly [s]."""
