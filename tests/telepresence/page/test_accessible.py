"""The page for everybody: what axe finds, sizes, names, reach by keys, languages, and the ways to press without a hand.

`axe/axe.min.js` is axe-core 4.14.1 of npm (MPL-2.0, by Deque Systems), unchanged, for this test alone: `npm pack
axe-core@4.14.1` gives it, the package's integrity is
sha512-FHfa+lmNjQZfJz1q8wKqIDwC6DExcHt/pkjNQb09a3NPjCKg2rhu5qb2S4r76ASyFNNtuFooJpZe37OgudVGtQ==.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import re
import time

import pytest
from axe import AXE, violations, wear
from repeated_presses import press_until
from waiting import wait_until

from telepresence.page.app import STATIC

pytestmark = pytest.mark.browser

AXE_SHA256 = "29348999450cdf2849a8e70b7912fc2da85a849da39c0d0d5394f51d4a9ed95c"
SIZES = {
    "phone": (390, 844),
    "phone across": (844, 390),
    "tablet": (820, 1180),
    "screen": (1280, 800),
    "200 %": (640, 400),
}
TARGET = 48
"""[px] the least size of what can be pressed."""
TRIES = 4
"""The best of so many counts where a press is timed: other programs hold up those of a busy machine."""


@pytest.fixture
def browser(chromium):
    return chromium


@pytest.fixture
def robot(page):
    return page.robots["Pepper"]


def test_axe_is_the_one_that_is_named_above():
    assert hashlib.sha256(AXE.read_bytes()).hexdigest() == AXE_SHA256


def test_axe_finds_nothing_before_anybody_is_in(browser):
    browser.open()
    browser.sign_in("anna", "wrong horse")
    browser.until("document.getElementById('enterProblem').textContent !== ''", "it says no")
    for theme in ("dark", "light"):
        wear(browser, theme)
        assert violations(browser) == []


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_in_any_state_of_driving(browser, robot, theme):
    browser.drive()
    wear(browser, theme)
    assert violations(browser) == []
    for size in ("phone", "screen"):
        browser.size(*SIZES[size])
        open_sheet(browser)
        assert violations(browser) == []
        browser.evaluate("document.getElementById('sheetClose').click()")
    browser.press("Escape")
    browser.until("document.getElementById('stop').textContent === 'Reset'", "the stop is pressed")
    assert violations(browser) == []
    reset_the_stop(browser)


def reset_the_stop(browser) -> None:
    """Press until it is reset: soon after a stop a second press resets nothing."""
    browser.until(
        "document.getElementById('stop').textContent === 'Stop' || void document.getElementById('stop').click()",
        "the stop is reset",
    )


def test_axe_finds_nothing_for_a_watcher(browser):
    browser.drive("will")
    assert violations(browser) == []


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_while_somebody_asks_and_while_a_link_is_shown(browser, page, robot, theme):
    browser.drive()
    wear(browser, theme)
    close_window = page.ask_for(robot, "ben")
    browser.until("!document.getElementById('give').hidden", "it can be handed over")
    assert browser.evaluate("document.getElementById('alert').textContent") == "ben asks to drive."
    assert violations(browser) == []
    close_window()
    browser.until("document.getElementById('give').hidden", "nobody asks any more")
    open_sheet(browser)
    browser.evaluate("document.querySelector('#section_links > button').click()")
    browser.until("document.querySelectorAll('#section_links canvas, #section_links li').length > 1", "code and list")
    assert violations(browser) == []
    browser.evaluate("document.getElementById('sheetClose').click()")


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_without_pictures_the_page_says_so_first_and_axe_finds_nothing(browser, robot, theme):
    browser.drive()
    wear(browser, theme)
    for reason, words in (("Free.", "The way is free."), ("No command for 2.7 s.", "Ready.")):
        robot.shown = {"gate": {"state": "free", "reason": reason, "allowed": [0, 0, 0]}}
        browser.until(f"document.getElementById('status').textContent === '{words}'", "the gate's reason")
    robot.dark = True
    try:
        browser.until("document.getElementById('picture').matches('.stale')", "the picture is old")
        browser.until(
            "document.getElementById('status').textContent === 'The robot\\'s camera sends no picture.'", "it is said"
        )
        assert violations(browser) == []
    finally:
        robot.dark, robot.shown = False, {"gate": None}
    browser.until("document.getElementById('status').textContent === 'Ready.'", "the picture is back")


def test_axe_finds_nothing_on_the_slower_way(browser):
    script = browser.tools.call("Page.addScriptToEvaluateOnNewDocument", source="delete globalThis.RTCPeerConnection")
    try:
        browser.drive(theme="light")
        browser.until("document.getElementById('way').dataset.way === 'slower'", "the slower way")
        browser.until("document.getElementById('alert').textContent !== ''", "it says why")
        for theme in ("light", "dark"):
            wear(browser, theme)
            assert violations(browser) == []
    finally:
        browser.tools.call("Page.removeScriptToEvaluateOnNewDocument", **script)
        browser.open()


def open_sheet(browser) -> None:
    browser.evaluate(
        "if (document.getElementById('sheet').hidden) document.getElementById('tool_menu').click();"
        "for (const each of document.querySelectorAll('#sheet details')) each.open = true"
    )


PRESSABLE = "button, summary, input, select, textarea, a[href]"


@pytest.mark.parametrize("size", list(SIZES))
def test_what_can_be_pressed_is_large_named_and_reached_and_the_stop_is_never_covered(browser, size):
    browser.size(*SIZES[size])
    browser.drive()
    for opened in (False, True):
        if opened:
            open_sheet(browser)
        small = browser.evaluate(
            f"[...document.querySelectorAll('{PRESSABLE}')].filter((e) => e.checkVisibility()).map((e) => {{"
            "const b = (e.closest('label') ?? e).getBoundingClientRect();"
            "return [e.id || e.textContent || e.outerHTML, b.width, b.height]; })"
        )
        assert [one for one in small if one[1] < TARGET or one[2] < TARGET] == []
        assert browser.evaluate(
            "[document.documentElement, document.getElementById('drive')].every((e) => e.scrollWidth <= innerWidth)"
        )
        x, y = browser.place("#stop")
        assert browser.evaluate(f"document.elementFromPoint({x}, {y}).id") == "stop"
        assert reached_by_tab(browser) == []
    browser.evaluate("document.getElementById('sheetClose').click()")


def reached_by_tab(browser) -> list[str]:
    """Return what can be pressed and is not reached, or is hidden when it has the focus."""
    browser.evaluate(
        f"window.left = new Set([...document.querySelectorAll('{PRESSABLE}')].filter((e) => e.checkVisibility() &&"
        "!e.closest('[inert]') && "
        "!(e.type === 'radio' && !e.checked))); window.hiddenOnes = []; document.activeElement.blur()"
    )
    for _ in range(browser.evaluate("window.left.size") + 6):
        browser.press("Tab", "Tab")  # it is scrolled to when the next frame is drawn
        browser.evaluate(
            "(async () => { const e = document.activeElement; window.left.delete(e);"
            "const seen = () => { const b = e.getBoundingClientRect();"
            "const at = document.elementFromPoint((b.left + b.right) / 2, (b.top + b.bottom) / 2);"
            "return e === document.body || (at && (e.contains(at) || at.contains(e))); };"
            "let frames = 60;"  # what the page says may lie there for a moment
            "do await new Promise(requestAnimationFrame); while (!seen() && (frames -= 1));"
            "if (!seen()) window.hiddenOnes.push(e); })()"
        )
    return browser.evaluate(  # who leaves meanwhile takes a row of the list along
        "[...window.left, ...window.hiddenOnes].filter((e) => e.checkVisibility()).map((e) => e.id || e.outerHTML)"
    )


def test_it_fits_a_width_of_320_pixels(browser):
    browser.size(320, 640)
    browser.drive()
    assert browser.evaluate("document.getElementById('drive').scrollWidth <= 320")
    x, y = browser.place("#stop")
    assert 0 < x < 320 and browser.evaluate(f"document.elementFromPoint({x}, {y}).id") == "stop"
    browser.size(1280, 800)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_text_on_a_plate_is_readable_on_black_and_on_white(browser, theme):
    wear(browser, theme)
    colours = browser.evaluate(
        "['--plate', '--text', '--good', '--warn', '--bad', '--quiet'].map((name) => {"
        "document.body.style.color = `var(${name})`;"
        "return getComputedStyle(document.body).color.match(/[\\d.]+/g).map(Number); })"
    )
    plate, *inks = colours
    for behind in (0, 255):
        under = [plate[3] * one + (1 - plate[3]) * behind for one in plate[:3]]
        assert all(contrast(ink, under) >= 4.5 for ink in inks), (theme, behind, [contrast(i, under) for i in inks])


def contrast(one, other) -> float:
    """WCAG 2's contrast of two colours, 0 to 255 each."""

    def luminance(colour):
        parts = [part / 255 for part in colour[:3]]
        linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


# Ways to press without a hand


def forward(robot, since: float) -> float:
    """Metres that were driven forward since then [monotonic s], by the setpoints."""
    now = time.monotonic()
    times = [*(when for when, _ in robot.driven), now]
    return sum(v.vx * (times[i + 1] - when) for i, (when, v) in enumerate(list(robot.driven)) if when >= since)


def stands(robot) -> bool:
    return robot.velocity == (0.0, 0.0, 0.0)


def test_a_key_of_the_keyboard_on_an_arrow_drives_one_step(browser, robot):
    began = 0.0

    def press() -> None:
        nonlocal began
        began = time.monotonic()
        browser.evaluate("document.querySelector('[data-drive=forward]').focus()")
        browser.tools.call("Input.dispatchKeyEvent", type="keyDown", code="Enter", key="Enter", text="\r")

    def release() -> None:
        browser.tools.call("Input.dispatchKeyEvent", type="keyUp", code="Enter", key="Enter")

    browser.drive()
    tries: list[float] = []  # m
    while not any(metres == pytest.approx(0.2, abs=0.06) for metres in tries):
        assert len(tries) < TRIES, f"a step of 0.2 m has {tries} m"
        press_until(press, release, wait_until, lambda: not stands(robot), "it drives")
        release()
        wait_until(lambda: stands(robot), "it stands")
        tries.append(forward(robot, began))


def test_click_and_click_ends_by_itself_is_renewed_and_ends_at_another_press(browser, robot):
    began = 0.0

    def click() -> None:
        nonlocal began
        began = time.monotonic()
        browser.click("[data-drive=forward]")

    def end() -> None:
        browser.click("#status")
        wait_until(lambda: stands(robot), "any other press ends it")

    def drive() -> None:
        press_until(click, end, wait_until, lambda: robot.velocity[0] == pytest.approx(0.1), "half speed")

    browser.drive(acting="click")
    by_itself: list[float] = []  # s
    while not any(1.7 < seconds < 3.5 for seconds in by_itself):
        assert len(by_itself) < TRIES, f"it ends by itself after {by_itself} s"
        drive()
        wait_until(lambda: stands(robot), "it ends by itself")
        by_itself.append(time.monotonic() - began)
    by_press: list[float] = []  # s
    while not any(seconds < 1.0 for seconds in by_press):
        assert len(by_press) < TRIES, f"it ends {by_press} s after the first press, by another one"
        drive()
        end()
        by_press.append(time.monotonic() - began)


def test_one_switch_drives_and_the_switch_stops(browser, robot):
    tries: list[float] = []  # s
    while not any(seconds < 0.5 for seconds in tries):
        assert len(tries) < TRIES, f"it stands after {tries} s"
        browser.drive(scanning=True, scanTime=0.5, acting="click")
        browser.until("document.querySelectorAll('#pad .scanned').length > 1", "the frame is on the arrows")
        browser.press("Space")
        browser.until("document.querySelector('[data-drive=forward]').matches('.scanned')", "the frame is on the arrow")
        browser.press("Space")
        wait_until(lambda: robot.velocity[0] == pytest.approx(0.1), "it drives")
        time.sleep(0.2)  # longer than a tremble of the switch
        pressed = time.monotonic()
        browser.press("Space")
        wait_until(lambda: stands(robot), "it stands")
        tries.append(time.monotonic() - pressed)
        assert browser.evaluate("document.getElementById('stop').matches('.scanned')")


def test_resting_presses_an_arrow_and_sooner_the_stop(browser, robot):
    browser.drive(dwelling=True, dwellTime=0.6, acting="click")
    browser.point(*browser.place("[data-drive=forward]"))
    wait_until(lambda: not stands(robot), "it drives")
    browser.point(640, 300)
    wait_until(lambda: stands(robot), "it ends by itself")
    tries: list[float] = []  # s
    while not any(seconds < 2.0 for seconds in tries):
        assert len(tries) < TRIES, f"the stop is pressed after {tries} s"
        browser.point(*browser.place("#stop"))
        began = time.monotonic()
        browser.until("document.getElementById('stop').textContent === 'Reset'", "the stop is pressed")
        tries.append(time.monotonic() - began)
        browser.point(640, 300)
        reset_the_stop(browser)


def test_letters_can_be_switched_off(browser, robot):
    browser.drive(letters=False)
    began = time.monotonic()
    browser.tools.call("Input.dispatchKeyEvent", type="keyDown", code="KeyW", key="w")
    time.sleep(0.4)  # of trying to drive
    browser.tools.call("Input.dispatchKeyEvent", type="keyUp", code="KeyW", key="w")
    assert forward(robot, began) == 0


def test_a_stop_is_announced_at_once_and_the_status_once_a_second(browser, robot):
    browser.drive()
    browser.evaluate(
        "window.said = []; for (const id of ['polite', 'urgent']) new MutationObserver(() =>"
        "window.said.push([id, performance.now(), document.getElementById(id).textContent]))"
        ".observe(document.getElementById(id), { childList: true })"
    )
    for number in range(12):
        robot.shown = {"gate": {"state": "free", "reason": f"Reason {number}.", "allowed": [0, 0, 0]}}
        time.sleep(0.15)  # ten times as often as it may be said
    browser.press("Escape")
    browser.until("window.said.some(([id, , words]) => id === 'urgent' && words.includes('anna'))", "the stop is said")
    said = browser.evaluate("window.said")
    assert 2 <= len(said) <= 5 and all(b[1] - a[1] >= 950 for a, b in itertools.pairwise(said))
    robot.shown = {"gate": None}
    reset_the_stop(browser)


# Languages


def languages() -> dict[str, dict]:
    return {path.stem[-2:]: json.loads(path.read_text()) for path in STATIC.glob("text_*.json")}


def test_every_language_says_the_same():
    every = languages()
    assert set(every) == {"en", "de"}
    sentences = {
        name: {f"{part}.{what}": words for part, all_ in texts.items() for what, words in all_.items()}
        for name, texts in every.items()
    }
    assert set(sentences["en"]) == set(sentences["de"])
    for key, words in sentences["en"].items():
        for other in sentences.values():
            assert set(re.findall(r"\{\w+\}", other[key])) == set(re.findall(r"\{\w+\}", words)), key
            assert other[key].strip(), key


def test_every_text_that_is_used_is_there():
    used = set()
    for path in STATIC.iterdir():
        if path.suffix == ".js":
            used |= set(re.findall(r'\btext\(\s*"(\w+\.\w+)"', path.read_text()))
        if path.suffix == ".html":
            used |= set(re.findall(r'data-(?:text|label)="([^"]+)"', path.read_text()))
    for texts in languages().values():
        assert {name for name in used if name.split(".")[1] not in texts.get(name.split(".")[0], {})} == set()


def test_a_german_browser_is_spoken_to_in_german(browser):
    browser.open(language="de")
    assert browser.evaluate("document.documentElement.lang") == "de"
    assert browser.evaluate("document.querySelector('#enterForm button').textContent") == "Hereinkommen"


def test_what_the_station_says_is_said_in_the_page_s_language(browser):
    browser.open(language="de")
    said = "import('/static/language.js').then((l) => {{ const e = document.createElement('p'); l.show(e, {});"
    for words, expected in {
        "Blocked by an obstacle 0.31 m ahead left. Free: behind, right.": [
            "Ein Hindernis versperrt den Weg: 0.31 m vorn links. Frei: hinten, rechts.", ""
        ],
        "anna may watch, not drive.": ["anna darf zusehen, nicht fahren.", ""],
        "Something new.": ["Something new.", "en"],
    }.items():  # fmt: skip
        assert browser.evaluate(said.format(json.dumps(words)) + "return [e.textContent, e.lang]; })") == expected
