"""Batteries and chargers.

`NiMH` and `Pb` are Robotino 3's: 24 V, two built-in chargers. `Li-Ion` is Robotino 4's: Festool packs of 18 V side by
side. Sources: battery names and low-voltage thresholds, Robotino's controld3 and controld3.conf (mirror
BusHero/robotino_api2); a full lead-acid battery, carologistics/fawkes-robotino; Li-Ion's range, that of Robotino 4's
display, wiki.openrobotino.org. Not published, hence chosen: NiMH's full voltage, and that a charge lasts four hours.
"""

from __future__ import annotations

from dataclasses import dataclass

SHUTDOWN_COUNTDOWN = 60_000
"""Milliseconds until the robot switches off once the battery is low; constant while it is not."""
RUN_TIME, CHARGE_TIME = 4 * 3600.0, 3 * 3600.0
"""Time from full to empty, and back [s]."""


@dataclass(frozen=True)
class BatteryKind:
    """A battery's voltages [V], and how the robot charges it."""

    full: float
    empty: float
    low: float
    chargers: int
    packs: int


KINDS = {
    "Pb": BatteryKind(full=24.5, empty=18.5, low=19.0, chargers=2, packs=0),
    "NiMH": BatteryKind(full=25.5, empty=19.3, low=19.8, chargers=2, packs=0),
    "Li-Ion": BatteryKind(full=20.5, empty=14.0, low=15.0, chargers=0, packs=2),
}


@dataclass(frozen=True)
class PowerState:
    """`charge` 0 to 1, `voltage` [V], `shutdown_counter` [ms], `external` is True on mains power."""

    kind: str
    charge: float
    voltage: float
    low: bool
    shutdown_counter: int
    external: bool


class Battery:
    """Empties while the robot is on, fills on external power. One thread.

    Args:
        kind: A key of `KINDS`.
        charge: At the start, 0 to 1.
        external: Whether the mains cable is connected at the start.
    Raises:
        ValueError: Unknown kind or impossible charge; the text names what there is.
    """

    def __init__(self, kind: str = "NiMH", charge: float = 0.9, external: bool = False) -> None:
        if kind not in KINDS:
            raise ValueError(f"there is no battery {kind!r}; batteries: {', '.join(KINDS)}")
        if not 0.0 <= charge <= 1.0:
            raise ValueError(f"a battery's charge lies between 0 and 1, got {charge}")
        self.kind = kind
        self._start, self._start_external = charge, external
        self.reset()

    def reset(self) -> None:
        """Return to the charge and the cable at the start."""
        self.external = self._start_external
        self._charge = self._start
        self._low_for = 0.0

    @property
    def state(self) -> PowerState:
        kind = KINDS[self.kind]
        voltage = round(kind.empty + self._charge * (kind.full - kind.empty), 2)
        counter = max(0, SHUTDOWN_COUNTDOWN - round(1000 * self._low_for))
        return PowerState(self.kind, self._charge, voltage, voltage < kind.low, counter, self.external)

    def elapse(self, dt: float) -> None:
        """Let `dt` seconds pass. The countdown to switching off runs while the battery is low and off the mains."""
        change = dt / CHARGE_TIME if self.external else -dt / RUN_TIME
        self._charge = min(1.0, max(0.0, self._charge + change))
        state = self.state
        self._low_for = self._low_for + dt if state.low and not self.external else 0.0
