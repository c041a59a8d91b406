"""What the driver of a Robotino says about the battery, and what window and page make of it."""

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from rto_node.client import Power
from rto_node.driver import battery_message, sensor_diagnosis

from robotino_sim.power import Battery
from telepresence.teleop.robot_readings import read_battery

pytestmark = pytest.mark.ros


@pytest.mark.parametrize("kind", ["NiMH", "Pb", "Li-Ion"])
def test_a_low_battery_is_low_in_the_window_and_not_broken_in_ros(kind):
    shown = []
    for charge in (0.0, 0.5, 1.0):
        state = Battery(kind, charge).state
        message = battery_message(Power(state.voltage, kind, state.low, state.external))
        assert message.power_supply_health == message.POWER_SUPPLY_HEALTH_GOOD
        shown.append(read_battery(message, 0.0).low)
        assert shown[-1] == state.low
    assert shown == [True, False, False]


def test_diagnostics_say_that_the_battery_is_low():
    assert sensor_diagnosis(False, "battery low: 19.5 V", 20.0, 20.0) == (DiagnosticStatus.WARN, "battery low: 19.5 V")
    assert sensor_diagnosis(False, "", 20.0, 20.0) == (DiagnosticStatus.OK, "20.0 readings/s")
    assert sensor_diagnosis(False, "", 10.0, 20.0)[0] == DiagnosticStatus.WARN
    assert sensor_diagnosis(True, "no answer", 0.0, 20.0) == (DiagnosticStatus.ERROR, "no answer")
