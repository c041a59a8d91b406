"""Presses of a gamepad: no browser tells of them, so the page looks. Chromium; the gamepads are a script's."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.browser

A, B = 0, 1
TAPS = 5
TAP = 30
"""[ms] from press to release: a quick finger's."""
PERIOD, SLOWER = 110, 210
"""[ms] between two taps: each falls at another moment between two of the page's ticks; a switch takes none that comes
within 150 ms of another."""
STOP = "document.getElementById('stop')"
PANIC = 1.0
"""[s] after a stop in which no press resets it (driving.js)."""
PADS = f"""
globalThis.looks = 0;
globalThis.pads = [];
navigator.getGamepads = () => {{ looks += 1; return pads; }};
globalThis.padOf = (index, ...down) => ({{ connected: true, index, id: `pad ${{index}}`, mapping: "standard",
  axes: [0, 0, 0, 0], buttons: [...Array(17).keys()].map((n) => ({{ pressed: down.includes(n), value: 0 }})) }});
globalThis.passed = (ms) => new Promise((done) => setTimeout(done, ms));
globalThis.seen = async () => {{ const enough = looks + 20; while (looks < enough) await passed(5); }};
globalThis.tap = async (button, ms) => {{
  pads[0].buttons[button].pressed = true;
  await passed(ms);
  pads[0].buttons[button].pressed = false;
}};
globalThis.framed = async () => {{ while (!document.querySelector("#stop.scanned")) await passed(5); }};
globalThis.asked = [];  // what the station is asked for
const send = RTCDataChannel.prototype.send;
RTCDataChannel.prototype.send = function (message) {{
  if (this.label === "ask") asked.push(JSON.parse(message).do);
  send.call(this, message);
}};
globalThis.clicked = 0;  // on the red stop
{STOP}.addEventListener("click", () => {{ clicked += 1; }});
"""


@pytest.fixture
def pilot(chromium):
    """Lets somebody in with these settings; without a gamepad, and nothing asked for yet."""

    def drive(**settings):
        chromium.drive(**settings)
        chromium.evaluate(f"globalThis.tap || (() => {{ {PADS} }})(); asked.length = 0; clicked = 0")
        return chromium

    yield drive
    chromium.evaluate("pads.length = 0; seen()")
    chromium.until(f"{STOP}.textContent === 'Stop' || void {STOP}.click()", "the stop is reset")


def test_each_tap_of_b_is_one_stop_however_it_falls_between_the_ticks(pilot):
    browser = pilot()
    asked = browser.evaluate(
        f"""(async () => {{
          pads.push(padOf(0));
          await seen();
          for (let n = 0; n < {TAPS}; n += 1) {{ await tap({B}, {TAP}); await passed({PERIOD - TAP}); }}
          await tap({B}, 300);  // and a long press
          await seen();
          return asked;
        }})()"""
    )
    assert asked == ["stop"] * (TAPS + 1)


def test_b_that_is_down_when_its_pad_appears_stops(pilot):
    """A browser shows a pad only once somebody presses one of its buttons, and a stop too many does no harm."""
    browser = pilot(scanning=False)  # a page that is loaded anew: it has not seen a gamepad
    stops = browser.evaluate(
        f"""(async () => {{
          const stops = [];
          const next = async () => {{ await seen(); stops.push(asked.length); }};
          pads.push(padOf(0, {B}));
          await next();
          await next();  // held on
          pads.length = 0;
          await next();  // its radio is gone
          pads.push(padOf(0, {B}));
          await next();
          pads.push(padOf(1));
          await next();
          await tap({B}, 0);  // let go of
          pads[1].buttons[{B}].pressed = true;  // somebody else's
          await next();
          return stops;
        }})()"""
    )
    assert stops == [1, 1, 1, 2, 2, 3]


@pytest.mark.parametrize("hangs", [False, True], ids=["at rest", "while another button hangs"])
def test_each_tap_of_a_switch_presses_what_is_framed(pilot, hangs):
    browser = pilot(scanning=True, scanTime=3)
    browser.evaluate(
        f"""(async () => {{
          pads.push(padOf(0));
          await framed();
          pads[0].buttons[9].pressed = {str(hangs).lower()};
          await passed({SLOWER});
          for (let n = 0; n < {TAPS}; n += 1) {{ await tap({A}, {TAP}); await passed({SLOWER - TAP}); }}
          await seen();
        }})()"""
    )
    assert browser.evaluate("clicked") == TAPS + hangs


def test_b_is_the_red_stop_and_no_switch_that_would_reset_it(pilot):
    browser = pilot(scanning=True, scanTime=3)
    browser.evaluate(f"{STOP}.click()")
    browser.until(f"{STOP}.ariaPressed === 'true'", "it is stopped")
    asked = browser.evaluate(
        f"""(async () => {{
          pads.push(padOf(0));
          await passed({1000 * PANIC + 100});
          await framed();
          asked.length = 0;
          await tap({B}, 100);
          await seen();
          return asked;
        }})()"""
    )
    assert asked == ["stop"]
    assert browser.evaluate(f"{STOP}.ariaPressed") == "true"
