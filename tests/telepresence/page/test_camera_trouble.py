"""The robot's camera is in trouble and nothing else is: the page says so, and nobody drives by an old picture."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.browser

STATUS = "document.getElementById('status').textContent"
AGE = "document.getElementById('age').textContent"
STALE = "document.getElementById('picture').classList.contains('stale')"
WAY = "document.getElementById('way').dataset.way"
OFFERS = "performance.getEntriesByType('resource').filter((entry) => entry.name.endsWith('/offer')).length"
TRIES = 4
"""The best of so many, as other programs hold up those of a busy machine."""
PRESSES = 10
LINK = """async (lost, picturesTake, statesTake) => {
  const { Link } = await import("./static/link.js");
  const dials = [];
  let now = 0;
  const clock = performance.now;
  performance.now = () => now;
  try {
    const link = new Link(document.createElement("video"), { onState() {} });
    link.dial = async () => { dials.push(now / 1000); link.dialling.begin(now); };
    link.pictureAt = link.shownAt = 0;
    const shown = [], states = [];
    let taken = 0;
    for (; now < 30000; now += 50) {
      const trouble = now >= 5000 && now < 25000;
      if (now % 100 === 0 && !(trouble && lost === "camera")) shown.push(now + picturesTake), taken = now;
      if (shown[0] <= now) {
        shown.shift();
        if (!trouble || lost === "camera") link.pictureAt = now;
      }
      if (now % 100 === 50)
        states.push([now + statesTake, { picture: [0, (now - taken) / 1000, taken / 1000] }]);
      if (states[0]?.[0] <= now) {
        const [[, state]] = states.splice(0, 1);
        if (!(trouble && lost === "nothing")) link.onState(state);
      }
      link.keep();
    }
  } finally {
    performance.now = clock;
  }
  return dials;
}"""
"""A link to which nothing happens but in a test: ten pictures and states a second, under way for so long [ms]; returns
when it dials [s]."""


WAYS = f"""(async () => {{
  const ways = [];
  for (const end = performance.now() + 4000; performance.now() < end;) {{
    ways.push({WAY});
    await new Promise((done) => setTimeout(done, 50));
  }}
  return ways;
}})()"""
"""Which ways the page takes for longer than it would wait until it dials."""


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
    for _ in range(PRESSES):
        chromium.press("KeyW", "w")
    assert {velocity[0] for _, velocity in robot.driven} <= {0.0}


def test_a_robot_without_pictures_keeps_the_connection_and_shows_the_next_one(chromium, robot):
    """Another connection would bring none either, and take sound and face along. On a busy machine, where states may be
    late, too, that is so in the best of a few tries."""
    chromium.drive()
    tries = []
    while ({"direct"}, 0) not in tries:
        assert len(tries) < TRIES, f"its ways, and how often it has dialled: {tries}"
        chromium.until(f"{WAY} === 'direct' && !{STALE}", "pictures come by WebRTC")
        dials = chromium.evaluate(OFFERS)
        robot.dark = True
        chromium.until(f'{STATUS} === "The robot\'s camera sends no picture." && {STALE}', "the page says so")
        ways = set(chromium.evaluate(WAYS))
        robot.dark = False
        chromium.until(f"{STATUS} === 'Ready.' && !{STALE}", "the next picture is there")
        tries.append((ways, chromium.evaluate(OFFERS) - dials))


@pytest.mark.parametrize(
    ("lost", "under_way", "least", "most"),
    [
        ("camera", (300, 0), None, None),
        ("camera", (50, 400), None, None),
        ("pictures", (300, 0), 0.9, 2.0),
        ("nothing", (300, 0), 0.9, 1.2),
    ],
)
def test_only_a_connection_that_brings_less_than_there_is_is_given_up(chromium, lost, under_way, least, most):
    """By a clock that stands still but for this test: five seconds are well, twenty are not, then all is well again."""
    chromium.drive()
    dials = chromium.evaluate(f"({LINK})('{lost}', ...{list(under_way)})")
    if least is None:
        assert dials == [], "a camera that is back is no reason either, although its first picture is on its way"
    else:
        assert least <= dials[0] - 5.0 <= most
