"""Logs every joint at a rate, as a driver does: measured and wanted angle and current, with the torso's place."""

import argparse
import math
import time

import qi

KEY = "Device/SubDeviceList/{}/{}/Value"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ip", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--rate", type=float, default=50.0, help="Hz")
    parser.add_argument("--seconds", type=float, default=10.0)
    arguments = parser.parse_args()
    session = qi.Session()
    session.connect(f"tcp://{arguments.ip}:{arguments.port}")
    motion, memory = session.service("ALMotion"), session.service("ALMemory")
    names = [name for name in motion.getBodyNames("Body") if not name.startswith("Wheel")]
    period, cycles, worst = 1.0 / arguments.rate, 0, 0.0
    begin = due = time.time()
    while time.time() < begin + arguments.seconds:
        commanded = motion.getAngles(names, False)
        torso = motion.getPosition("Torso", 1, True)
        measured = [memory.getData(KEY.format(name, "Position/Sensor")) for name in names]
        currents = [memory.getData(KEY.format(name, "ElectricCurrent/Sensor")) for name in names]
        worst = max(worst, *(abs(wanted - found) for wanted, found in zip(commanded, measured, strict=True)))
        cycles += 1
        due = max(due + period, time.time() - period)
        time.sleep(max(0.0, due - time.time()))
    print(f"{len(names)} joints, {cycles} cycles")
    print(f"worst error: {worst:.3f} rad")
    print(f"torso at height {torso[2]:.2f} m")
    print(f"head yaw {measured[names.index('HeadYaw')]:.3f}, {max(map(abs, currents)):.2f} A at most")
    print("finite:", all(math.isfinite(value) for value in [*measured, *currents]))


main()
