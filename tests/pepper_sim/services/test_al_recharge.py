"""ALRecharge over the wire: a robot that charges itself, in a room with its station."""

import math

import pytest

from pepper_sim.simulation import Simulation, read_station

STATION = (1.6, 0.2, math.pi - 0.15)


@pytest.fixture(scope="module", name="room")
def _room(qi):
    with Simulation(scene="empty", port=0, station=",".join(map(str, STATION))) as simulation:
        session = qi.Session()
        session.connect(simulation.url)
        yield simulation, session
        session.close()


def test_the_robot_finds_its_station_docks_charges_and_leaves(room):
    simulation, session = room
    recharge, motion, memory = (session.service(name) for name in ("ALRecharge", "ALMotion", "ALMemory"))
    assert recharge.dockOnStation() == 4  # no station was seen yet
    assert recharge.goToStation() == 0
    x, y, _, _, _, yaw = simulation.robot.truth()
    assert math.dist((x, y), STATION[:2]) < 0.06 and abs(math.remainder(yaw - STATION[2], math.tau)) < 0.2
    assert math.dist(recharge.getStationPosition()[:2], STATION[:2]) < 0.06
    battery = simulation.robot.snapshot().battery
    assert battery.plugged and battery.current > 0.0
    assert memory.getData("Device/SubDeviceList/Battery/Current/Sensor/Value") > 0.0
    assert motion.moveTo(0.2, 0.0, 0.0) is False  # only leaveStation moves it now
    assert recharge.lookForStation()[0] == 3 and recharge.getStatus() == 0
    assert recharge.leaveStation() == 0
    assert math.dist(simulation.robot.truth()[:2], STATION[:2]) > 0.5
    assert motion.moveTo(0.05, 0.0, 0.0) is True


def test_a_robot_asleep_stays_where_it_is(naoqi):
    naoqi.ALMotion.rest()
    assert naoqi.ALRecharge.lookForStation()[0] == 8
    assert naoqi.ALRecharge.goToStation() == 8


def test_a_search_is_stopped(naoqi):
    looking = naoqi.ALRecharge.lookForStation(_async=True)
    while naoqi.ALRecharge.getStatus() != 1:
        assert looking.isRunning()
    assert naoqi.ALRecharge.goToStation() == 10  # one at a time
    naoqi.ALRecharge.stopAll()
    assert looking.value(3000) == [1, [0.0, 0.0, 0.0]]
    assert naoqi.ALRecharge.getStatus() == 0


def test_a_station_stands_at_three_numbers():
    assert read_station("") is None and read_station("1,-2,0.5") == (1.0, -2.0, 0.5)
    for text in ("1,2", "here", "1,2,nan"):
        with pytest.raises(ValueError, match="a charging station stands at"):
            read_station(text)
