import pytest

from robotino_sim.power import CHARGE_TIME, KINDS, RUN_TIME, Battery


def test_empties_and_counts_down_when_low():
    battery = Battery("NiMH", charge=1.0)
    assert battery.state.voltage == KINDS["NiMH"].full
    assert not battery.state.low
    battery.elapse(RUN_TIME)
    assert battery.state.voltage == KINDS["NiMH"].empty
    assert battery.state.low
    battery.elapse(20.0)
    assert battery.state.shutdown_counter < 60_000
    battery.elapse(100.0)
    assert battery.state.shutdown_counter == 0


def test_external_power_charges_and_suppresses_the_countdown():
    battery = Battery("Pb", charge=0.0)
    battery.elapse(10.0)
    assert battery.state.shutdown_counter < 60_000
    battery.external = True
    battery.elapse(1.0)
    assert battery.state.shutdown_counter == 60_000
    battery.elapse(CHARGE_TIME)
    assert battery.state.charge == 1.0


def test_reset_restores_the_start():
    battery = Battery("Li-Ion", charge=0.5)
    before = battery.state
    battery.external = True
    battery.elapse(1000.0)
    battery.reset()
    assert battery.state == before


def test_unknown_batteries_are_refused_by_name():
    with pytest.raises(ValueError, match="Pb, NiMH, Li-Ion"):
        Battery("potato")
    with pytest.raises(ValueError, match="between 0 and 1"):
        Battery("Pb", charge=1.5)
