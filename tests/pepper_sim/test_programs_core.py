"""Programs about the robot's system, memory and notifications, run unchanged; what they did is seen in the world."""

import contextlib
import subprocess
import time

import numpy as np


def heard_since(naoqi, begin):
    """How loud the robot has been since `begin` [s, monotonic]: the greatest sample."""
    count = int(16000 * (time.monotonic() - begin))
    return np.abs(naoqi.simulation.room.loudspeaker.track.render(begin, count, 16000)).max()


def test_battery(naoqi, run_against_robot):
    charge = round(100 * naoqi.robot.snapshot().battery.charge)
    assert run_against_robot("core_battery").splitlines() == [f"battery: {charge} %"]
    begin = time.monotonic()
    assert "said so" in run_against_robot("core_battery", "--low", 101)
    assert heard_since(naoqi, begin) > 0.01


def test_notifications(naoqi, run_against_robot, wait_until):
    pending = naoqi.ALNotificationManager
    for entry in pending.notifications():  # of other tests
        pending.remove(dict(entry)["id"])
    printed = run_against_robot("core_notifications", "--severity", "warning", "Mind the step.").splitlines()
    number = printed[0].removeprefix("Notification ID: ")
    assert printed[1:] == [f"{number} warning Mind the step. True"]
    begin = time.monotonic()
    naoqi.robot.press("ChestButton", True)
    wait_until(lambda: naoqi.ALMemory.getData("ChestButtonPressed") == 1.0, "the button is down")
    naoqi.robot.press("ChestButton", False)
    wait_until(lambda: pending.notifications() == [], "it has been read")
    wait_until(lambda: heard_since(naoqi, begin) > 0.01, "it is heard")


def test_a_gesture(naoqi, start_against_robot, wait_until):
    program = start_against_robot("core_gestures")
    assert program.stdout.readline() == "Touch my head.\n"
    begin = time.monotonic()

    def tapped():
        """Where a busy machine felt one finger before the others, that was no tap: it taps again."""
        for pressed in (True, False):
            with naoqi.robot.world.locked():  # all at once, as a hand does
                for sensor in ("FrontTactil", "MiddleTactil", "RearTactil"):
                    naoqi.robot.press(sensor, pressed)
            time.sleep(0.3)  # a hand rests
        with contextlib.suppress(subprocess.TimeoutExpired):
            program.wait(1.0)  # longer than the pause of a double tap
        return program.poll() is not None

    wait_until(tapped, "the gesture was recognised")
    assert program.communicate(timeout=60)[0] == "SingleTap\n"
    assert program.returncode == 0 and heard_since(naoqi, begin) > 0.01


def test_system(naoqi, run_against_robot):
    printed = run_against_robot("core_system", "--name", "Salt").splitlines()
    assert printed[0].startswith("version: 2.5.") and printed[1:3] == ["type: Pepper", "body: Juliette"]
    assert printed[3:5] == ["disk: /home True", "network: online ['ethernet']"]
    assert printed[-1] == "renamed: True" and naoqi.ALSystem.robotName() == "Salt"
    naoqi.ALSystem.setRobotName("Pepper")


def test_an_old_module(naoqi, start_against_robot, wait_until):
    program = start_against_robot("core_memory_events")
    assert program.stdout.readline() == "subscribers: ['Counter']\n"
    memory = naoqi.ALMemory
    for touch in (1, 2):
        naoqi.robot.press("MiddleTactil", True)
        wait_until(lambda count=touch: memory.getListData(["Counter/Touches"]) == [count], "the touch was counted")
        naoqi.robot.press("MiddleTactil", False)
        wait_until(lambda: memory.getData("MiddleTactilTouched") == 0.0, "the hand is gone")
    assert program.communicate(timeout=60)[0] == "touched 2 times\n"
