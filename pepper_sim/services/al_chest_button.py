"""ALChestButton: the chest button's events, which `pepper_sim.naoqi.body_events` raises."""

from __future__ import annotations

from pepper_sim.naoqi.body_events import CLICKS
from pepper_sim.naoqi.extractor import Extractor


class ALChestButton(Extractor):
    """Raises the events of the chest button."""

    name = "ALChestButton"
    events = ("ChestButtonPressed", *CLICKS)
