"""The connectors on Robotino's back: eight digital and eight analogue inputs, eight outputs, two relays, one motor.

Nothing is plugged in: inputs show what a test or a person put there, outputs only remember what was asked for.
Source of the counts: wiki.openrobotino.org, Rest api.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence

DIGITAL_INPUTS = DIGITAL_OUTPUTS = ANALOG_INPUTS = 8
RELAYS = 2
MAX_VOLTAGE = 10.0
"""Range of an analogue input [V]."""
MAX_POWER = 100.0
"""Range of the power output, in both directions [%]."""


class InputsOutputs:
    """State of all inputs and outputs. Any thread may read and write."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.reset()

    def reset(self) -> None:
        """Switch everything off."""
        with self._lock:
            self._digital_inputs = [False] * DIGITAL_INPUTS
            self._analog_inputs = [0.0] * ANALOG_INPUTS
            self._digital_outputs = [False] * DIGITAL_OUTPUTS
            self._relays = [False] * RELAYS
            self._power_output = 0.0

    @property
    def digital_inputs(self) -> list[bool]:
        with self._lock:
            return list(self._digital_inputs)

    @property
    def analog_inputs(self) -> list[float]:
        """[V]"""
        with self._lock:
            return list(self._analog_inputs)

    @property
    def digital_outputs(self) -> list[bool]:
        with self._lock:
            return list(self._digital_outputs)

    @property
    def relays(self) -> list[bool]:
        with self._lock:
            return list(self._relays)

    @property
    def power_output(self) -> float:
        """[%]"""
        with self._lock:
            return self._power_output

    @property
    def power_output_current(self) -> float:
        """[A]; no motor is connected."""
        return 0.0

    def set_digital_input(self, number: int, value: bool) -> None:
        """Apply a signal from outside. Raises IndexError for a number beyond 0..7."""
        self._set(self._digital_inputs, number, bool(value), "digital input")

    def set_analog_input(self, number: int, volts: float) -> None:
        """Apply a voltage from outside, cut to 0..10 V. Raises IndexError for a number beyond 0..7."""
        self._set(self._analog_inputs, number, max(0.0, min(MAX_VOLTAGE, float(volts))), "analogue input")

    def set_digital_output(self, number: int, value: bool) -> None:
        """Set one digital output. Raises IndexError for a number beyond 0..7."""
        self._set(self._digital_outputs, number, bool(value), "digital output")

    def set_digital_outputs(self, values: Sequence[bool]) -> None:
        """Set all digital outputs. Raises ValueError unless there are eight values."""
        self._set_all(self._digital_outputs, values, "digital outputs")

    def set_relay(self, number: int, value: bool) -> None:
        """Set one relay. Raises IndexError for a number beyond 0..1."""
        self._set(self._relays, number, bool(value), "relay")

    def set_relays(self, values: Sequence[bool]) -> None:
        """Set both relays. Raises ValueError unless there are two values."""
        self._set_all(self._relays, values, "relays")

    def set_power_output(self, percent: float) -> None:
        """Drive the motor output; cut to -100..100 %."""
        with self._lock:
            self._power_output = max(-MAX_POWER, min(MAX_POWER, float(percent)))

    def _set(self, values: list, number: int, value: object, name: str) -> None:
        if not 0 <= number < len(values):
            raise IndexError(f"{name}s are numbered 0 to {len(values) - 1}, there is no {number}")
        with self._lock:
            values[number] = value

    def _set_all(self, values: list, new: Sequence[bool], name: str) -> None:
        if len(new) != len(values):
            raise ValueError(f"there are {len(values)} {name}, got {len(new)} values")
        with self._lock:
            values[:] = [bool(value) for value in new]
