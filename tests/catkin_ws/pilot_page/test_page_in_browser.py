"""The pilot's page as people use it: Chromium, a ROS graph, the real drive_lease; the robot is but its topics.

Coming in by a password, or by a link that is made, opened, driven by and withdrawn.
"""

from __future__ import annotations

import re
import subprocess
import sys
import time

import pytest
from page_browser import FORWARD, ZERO, drives, enter, heard

pytestmark = [pytest.mark.ros, pytest.mark.browser]

GUEST = "Lena (guest)"
SECRET = re.compile(r"#i=[\w-]{43}")


def asked(browser) -> bool:
    return browser.evaluate("!document.getElementById('enter').hidden && document.hasFocus()")


def open_link(browser, link, wait_until, name="Lena"):
    browser.tools.call("Page.navigate", url=link)
    wait_until(lambda: browser.text("enterTitle") == "You are invited", "the page takes the link")
    assert "#" not in browser.evaluate("location.href + document.referrer"), "the address bar keeps no secret"
    browser.evaluate(f"document.querySelector('[name=name]').value = '{name}'")
    browser.evaluate("document.querySelector('#enterForm button').click()")
    wait_until(lambda: browser.width() == 160, "the picture is there")


def people(browser) -> list[str]:
    shown = "[...row.children].filter((part) => !part.hidden).map((part) => part.textContent).join(', ')"
    return browser.evaluate(f"[...document.querySelectorAll('#section_people li')].map((row) => {shown})")


def invite(page_program, *words) -> str:
    """Return what ./stack invite prints."""
    argv = page_program.process.args
    users = argv[argv.index("--users") + 1]
    command = [sys.executable, "-m", "telepresence.station.invite", *words, "--users", users]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def test_a_newcomer_signs_in_sees_and_drives(anna, probe, wait_until):
    drives(probe, wait_until, anna)
    anna.key("KeyW", False)
    wait_until(lambda: heard(probe)[-1] == ZERO, "the release stops")
    assert anna.errors == [] and anna.text("age").endswith("ms")


def test_a_guest_drives_by_a_link_until_it_is_withdrawn(anna, open_page, running, probe, wait_until):
    anna.evaluate("document.querySelector('#section_links').parentElement.open = true")
    anna.evaluate("document.querySelector('#section_links select[name=role]').value = 'pilot'")
    anna.evaluate("document.querySelector('#section_links button.primary').click()")
    wait_until(lambda: anna.evaluate("document.querySelector('.made input')?.value"), "there is a link")
    link = anna.evaluate("document.querySelector('.made input').value")
    assert SECRET.search(link) and anna.evaluate("document.querySelector('.qr').width") > 20

    lena = open_page()
    open_link(lena, link, wait_until)
    wait_until(lambda: f"{GUEST}, may drive, Hand over" in people(anna), "anna sees who has come in")
    anna.evaluate("document.querySelector('#section_people button:not([hidden])').click()")
    wait_until(lena.is_there, "anna has handed the robot over")
    drives(probe, wait_until, lena)

    anna.evaluate("document.querySelector('#section_links li button').click()")
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot stands")
    wait_until(lambda: asked(lena), "the guest is out")
    wait_until(lambda: lena.text("enterProblem") == "Your invitation has ended.", "the page says why")
    assert "#i=" not in lena.evaluate("JSON.stringify(localStorage) + JSON.stringify(sessionStorage)")
    wait_until(lambda: not any(GUEST in row for row in people(anna)), "and not listed any more")
    history = lena.tools.call("Page.getNavigationHistory")["entries"]
    assert not any(SECRET.search(entry["url"]) for entry in history), "nor does the history keep a secret"
    assert anna.errors == lena.errors == []


def test_a_wrong_password_shows_no_picture(open_page, wait_until):
    browser = open_page()
    wait_until(lambda: browser.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is")
    browser.sign_in("anna", "wrong horse")
    wait_until(lambda: browser.text("enterProblem"), "it says no")
    assert browser.width() == 0 and browser.evaluate("document.getElementById('drive').hidden")


def test_a_watcher_sees_and_cannot_drive(open_page, probe, wait_until):
    browser = open_page()
    wait_until(lambda: browser.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is")
    browser.sign_in("will")
    wait_until(lambda: browser.width() == 160, "the picture is there")
    wait_until(lambda: "may watch, not drive" in browser.text("status"), "it says so")
    probe.forget("/cmd_vel")
    browser.key("KeyW", True)
    time.sleep(0.5)  # of trying to drive
    browser.key("KeyW", False)
    assert FORWARD not in heard(probe)


def test_the_command_line_s_link_lets_one_person_watch(open_page, running, wait_until):
    link = re.search(r"https://\S+", invite(running[0], "--watch", "--once"))[0]
    watcher = open_page()
    open_link(watcher, link, wait_until)
    wait_until(lambda: "may watch, not drive" in watcher.text("status"), "it says so")
    assert watcher.evaluate("document.getElementById('section_links').parentElement.hidden"), "nor invites"
    second = open_page()
    second.tools.call("Page.navigate", url=link)
    wait_until(lambda: second.text("enterTitle") == "You are invited", "the page takes the link")
    second.evaluate("document.querySelector('#enterForm button').click()")
    wait_until(lambda: "has been used" in second.text("enterProblem"), "it says why not")


def test_without_webrtc_a_websocket_carries_pictures_and_commands(open_page, probe, wait_until):
    browser = enter(open_page("delete globalThis.RTCPeerConnection"), wait_until)
    drives(probe, wait_until, browser)
    browser.key("KeyW", False)
    wait_until(lambda: heard(probe)[-1] == ZERO, "the release stops")
    assert browser.errors == []
