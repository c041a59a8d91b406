"""Window and page drive equally fast by hand."""

import re

from telepresence.page.app import STATIC
from telepresence.teleop import hand_speeds


def test_browsers_have_the_windows_numbers():
    script = (STATIC / "held.js").read_text()
    numbers = re.findall(r"^(?:export )?const (\w+) = ([\d.]+);", script, re.MULTILINE)
    assert {name: float(number) for name, number in numbers} == {
        name: value for name, value in vars(hand_speeds).items() if name.isupper()
    }
