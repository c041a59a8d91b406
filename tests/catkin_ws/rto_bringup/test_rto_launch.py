"""What the launch files of a Robotino tell its nodes."""

from __future__ import annotations

import pytest
import yaml


@pytest.mark.parametrize(("words", "gated"), [((), True), (("safety:=false",), False)])
def test_the_driver_waits_for_the_gate_that_is_started_with_it(roslaunch_says, words, gated):
    parameters = yaml.safe_load(roslaunch_says("--dump-params", "rto_bringup", "rto.launch", *words))
    assert parameters["/rto3/rto_core/gated"] is gated
