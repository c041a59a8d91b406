"""The page on the tablet when nothing new comes: its script, in Chromium, by a clock that a test moves.

What is true at once on the page of a station that has died is in test_page_in_browser.py.
"""

from __future__ import annotations

import json
import re
import urllib.request
from collections.abc import Callable, Iterator

import pytest

from pepper_sim.tablet.devtools import DevTools

pytestmark = pytest.mark.browser

NOTICED, GONE = 4.0, 25.0
"""[s] after which a face that has stopped is not called live any more, and after which it is not shown any more."""
CUT, BACK, END = 20.0, 80.0, 90.0
"""When the trouble begins and is over, and when a test ends [s]."""
HARNESS = """(script, trouble, cut, back, end) => {
  let now = 0;
  const due = [], log = [], later = (ms, what) => due.push([now + ms, what]);
  const note = (kind, value) => log.push([now / 1000, kind, value]);
  const body = { set className(name) { if (name !== this.name) note("class", this.name = name); },
    get className() { return this.name; } };
  const part = (kind) => ({ naturalWidth: 640, className: "", words: "",
    set src(value) { note("src", value); },
    set textContent(words) { if (words !== this.words) note(kind, this.words = words); } });
  const parts = { picture: part("picture"), words: part("words"), looking: part("looking") };
  const away = () => now >= cut && now < back;
  class Request {
    open() {}
    send() {
      if (trouble === "cut" && away()) later(this.timeout, () => this.ontimeout());
      else later(5, () => {
        const age = trouble === "frozen" && away() ? (now - cut) / 1000 : 0.04;
        this.status = 200;
        this.responseText = JSON.stringify({ run: "RUN", state: "live", looking: ["anna"], stalled: 0.1, age });
        this.onload();
      });
    }
  }
  const setInterval = (what, period) => later(period, () => { what(); setInterval(what, period); });
  new Function("document", "window", "XMLHttpRequest", "Date", script)(
    { getElementById: (name) => parts[name], body }, { setInterval, setTimeout: (what, ms) => later(ms, what) },
    Request, { now: () => now });
  while (now < end) {
    due.sort((one, other) => one[0] - other[0]);
    const [at, what] = due.shift();
    now = at;
    what();
  }
  return log;
}"""


@pytest.fixture(scope="module")
def tools() -> Iterator[DevTools]:
    tools = DevTools(lambda *_: None)
    yield tools
    tools.close()


@pytest.fixture
def live(tools: DevTools, open_page: Callable) -> Callable:
    """What the page does while nothing new comes from `CUT` to `BACK`: (when [s], what, value)."""
    with urllib.request.urlopen(open_page().server.url, timeout=10.0) as answer:
        page = answer.read().decode()
    script = re.sub(r'run = "\w+"', 'run = "RUN"', re.search(r"<script>(.*)</script>", page, re.DOTALL)[1])

    def live(trouble: str, late: float) -> list[tuple[float, str, str]]:
        arguments = json.dumps([script, trouble, 1000 * (CUT + late), 1000 * BACK, 1000 * END])
        answer = tools.call("Runtime.evaluate", expression=f"({HARNESS})(...{arguments})", returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return [tuple(entry) for entry in answer["result"]["value"]]

    return live


def classes(log: list[tuple[float, str, str]]) -> list[tuple[float, str]]:
    return [(when, value) for when, kind, value in log if kind == "class"]


@pytest.mark.parametrize("late", [0.0, 0.1, 1.0, 1.9], ids=str)
@pytest.mark.parametrize("trouble", ["cut", "frozen"])
def test_a_face_that_has_stopped_is_called_so_and_then_taken_away(trouble: str, late: float, live: Callable) -> None:
    log = live(trouble, late)
    (_, first), (noticed, second), (taken, third), (again, fourth) = classes(log)
    assert [first, second, third, fourth] == ["live", "waiting", "gone", "live"]
    assert noticed - (CUT + late) < NOTICED + (2.0 if trouble == "frozen" else 0.0)
    assert 19.0 < taken - (CUT + late) < GONE and again - BACK < NOTICED
    words = [value for when, kind, value in log if kind == "words" and when == taken]
    assert words == ["is not here"]
    shown = [(when, value) for when, kind, value in log if kind == "src" and when > CUT]
    assert shown[0][0] == taken and shown[0][1].startswith("data:"), "nothing is left of the picture"
    assert shown[1][0] == again and shown[1][1].startswith("video_feed"), "and it comes back"
    if trouble == "cut":
        named = [(when, value) for when, kind, value in log if kind == "looking" and when > CUT]
        assert named[0] == (noticed, " is looking through my eyes") and "anna" in named[-1][1]


def test_one_missing_answer_is_noticed_and_opens_no_new_stream(live: Callable) -> None:
    log = live("cut", BACK - CUT - 2.1)
    assert [value for _, value in classes(log)] == ["live", "waiting", "live"]
    assert [kind for _, kind, _ in log if kind == "src"] == []
