"""Recordings and programs made with rto_msgs or robotino_msgs must fit: names, types and order of the fields."""

import subprocess
import sys

import pytest

FIELDS = {
    "msg.AnalogReadings": "stamp time, values float32[]",
    "msg.DigitalReadings": "stamp time, values bool[]",
    "msg.MotorReadings": "stamp time, velocities float32[], positions int32[], currents float32[]",
    "msg.EncoderReadings": "stamp time, velocity uint32, position uint32, current uint32",
    "msg.PowerReadings": "stamp time, current float32, voltage float32",
    "msg.GripperState": "stamp time, state bool",
    "msg.BHAReadings": "stamp time, pressures float32[], cablepull float32[]",
    "msg.SetBHAPressures": "pressures float32[]",
    "msg.GrapplerReadings": (
        "stamp time, seq uint32, numServos uint32, torqueEnabled bool, angles float32[], velocities float32[], "
        "errors uint32[], channels uint32[], ids uint32[], cwAxesLimits float32[], ccwAxesLimits float32[]"
    ),
    "msg.SetGrapplerAxes": "stamp time, angles float32[], velocities float32[]",
    "msg.SetGrapplerAxis": "stamp time, axis uint32, angle float32, velocity float32",
    "msg.NorthStarReadings": (
        "stamp time, seq uint32, roomId uint32, numSpotsVisible uint32, pose geometry_msgs/Pose, magSpot0 uint32, "
        "magSpot1 uint32"
    ),
    "srv.ResetOdometryRequest": "x float32, y float32, phi float32",
    "srv.SetEncoderPositionRequest": "position uint32, velocity uint32",
    "srv.SetGripperStateRequest": "state bool",
}


@pytest.fixture(scope="module")
def found(workspace_environment):
    program = (
        "import importlib, sys\n"
        "for word in sys.argv[1:]:\n"
        "    module, name = word.split('.')\n"
        "    kind = getattr(importlib.import_module('rto_msgs.' + module), name)\n"
        "    print(word, ', '.join(f'{n} {t}' for n, t in zip(kind.__slots__, kind._slot_types)), sep=':')\n"
    )
    lines = subprocess.run(
        [sys.executable, "-c", program, *FIELDS], env=workspace_environment, check=True, capture_output=True, text=True
    ).stdout.splitlines()
    return dict(line.split(":") for line in lines)


@pytest.mark.parametrize("name", FIELDS)
def test_fields(found, name):
    assert found[name] == FIELDS[name]
