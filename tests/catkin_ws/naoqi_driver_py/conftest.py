"""Fixtures of the driver's tests."""

from __future__ import annotations

import pytest
from onboard_pepper import Motion


@pytest.fixture
def motion(naoqi) -> Motion:
    """An ALMotion that notes what it is asked, at the small NAOqi."""
    made = Motion()
    naoqi.register("ALMotion", made)
    return made
