"""The robot's camera is in trouble and nothing else is: the page says so, and nobody drives by an old picture."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.browser

STATUS = "document.getElementById('status').textContent"
AGE = "document.getElementById('age').textContent"
STALE = "document.getElementById('picture').classList.contains('stale')"
TRIES = 10


@pytest.fixture
def robot(page):
    robot = page.robots["Pepper"]
    yield robot
    robot.dark, robot.late = False, 0.0


@pytest.mark.parametrize(("late", "said"), [(3.0, "Picture 3."), (3600.0, "Picture more than an hour old")])
def test_nobody_drives_by_pictures_that_are_old_when_they_come(page, chromium, robot, late, said):
    """Their stamps are of the station's own clock, or the clocks of its machines disagree: then nobody knows better."""
    robot.late = late
    chromium.open()
    chromium.drive()
    chromium.until(f"{STATUS} === 'The picture is more than a second old.' && {STALE}", "the page says so")
    chromium.until(f"{AGE}.startsWith('{said}')", "and how old it is")
    robot.driven.clear()
    for _ in range(TRIES):
        chromium.press("KeyW", "w")
    assert {velocity[0] for _, velocity in robot.driven} <= {0.0}
