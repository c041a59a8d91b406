"""The safety gate's message: whoever shows or records it relies on its fields, and its words are the gate's."""

import numpy as np
from telepresence_msgs.msg import SafetyState

from telepresence.safety import SECTORS, State


def test_fields():
    assert dict(zip(SafetyState.__slots__, SafetyState._slot_types, strict=True)) == {
        "header": "std_msgs/Header",
        "state": "string",
        "reason": "string",
        "allowed": "float32[72]",
        "gap": "float32",
        "sector": "int16",
        "command_age": "float32",
        "vx": "float32",
        "vy": "float32",
        "wz": "float32",
        "scanning": "bool",
    }


def test_one_allowed_speed_per_sector_of_the_gate():
    assert np.shape(SafetyState().allowed) == (SECTORS,)


def test_every_state_of_the_gate_has_its_constant():
    assert {getattr(SafetyState, state.name) for state in State} == {state.value for state in State}
