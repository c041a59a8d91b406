"""Programs of ROS that start and live without numpy."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    "module",
    ["telepresence_ros.rosout", "telepresence_ros.supervisor", "telepresence_ros.without_numpy, twist_keyboard.node"],
)
def test_a_small_program_imports_ros_without_numpy_and_can_have_it_later(module):
    program = f"import sys, {module}; print('numpy' in sys.modules); import numpy; print(numpy.zeros(2).shape)"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert found.stdout.split("\n")[:2] == ["False", "(2,)"]


def test_messages_take_numbers_of_numpy_where_it_was_there_before():
    program = """
import numpy, telepresence_ros.without_numpy
from std_msgs.msg import Float64
import io
Float64(numpy.float32(1.5)).serialize(io.BytesIO())
"""
    subprocess.run([sys.executable, "-c", program], timeout=60, check=True)
