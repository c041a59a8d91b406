import pytest

from robotino_sim.inputs_outputs import InputsOutputs


@pytest.fixture
def connectors():
    return InputsOutputs()


def test_starts_with_everything_off(connectors):
    assert connectors.digital_inputs == connectors.digital_outputs == [False] * 8
    assert connectors.analog_inputs == [0.0] * 8
    assert connectors.relays == [False] * 2
    assert connectors.power_output == connectors.power_output_current == 0.0


def test_remembers_what_was_set(connectors):
    connectors.set_digital_output(7, True)
    connectors.set_relays([False, True])
    connectors.set_digital_input(0, True)
    connectors.set_analog_input(3, 4.5)
    connectors.set_power_output(-40)
    assert connectors.digital_outputs == [False] * 7 + [True]
    assert connectors.relays == [False, True]
    assert connectors.digital_inputs[0] and connectors.analog_inputs[3] == 4.5
    assert connectors.power_output == -40.0
    connectors.reset()
    assert not any(connectors.digital_outputs + connectors.relays + connectors.digital_inputs)


def test_cuts_to_what_the_hardware_can(connectors):
    connectors.set_analog_input(0, 12.0)
    connectors.set_power_output(400.0)
    assert connectors.analog_inputs[0] == 10.0
    assert connectors.power_output == 100.0


def test_refuses_what_there_is_not(connectors):
    with pytest.raises(IndexError, match="0 to 7"):
        connectors.set_digital_output(8, True)
    with pytest.raises(IndexError, match="0 to 1"):
        connectors.set_relay(-1, True)
    with pytest.raises(ValueError, match="8 digital outputs"):
        connectors.set_digital_outputs([True])


def test_a_copy_is_handed_out(connectors):
    connectors.digital_outputs[0] = True
    assert connectors.digital_outputs[0] is False
