"""Programs about the robot's system, memory and notifications, run unchanged; what they did is seen in the world."""

import time

import numpy as np


def test_battery(naoqi, run_against_robot):
    charge = round(100 * naoqi.robot.snapshot().battery.charge)
    assert run_against_robot("core_battery").splitlines() == [f"battery: {charge} %"]
    begin = time.monotonic()
    assert "said so" in run_against_robot("core_battery", "--low", 101)
    played = naoqi.simulation.room.loudspeaker.track.render(begin, int(16000 * (time.monotonic() - begin)), 16000)
    assert np.abs(played).max() > 0.01, "it was heard"
