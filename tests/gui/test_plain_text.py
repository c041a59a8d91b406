"""Whatever a robot, a person or a file's name says, the window shows it literally, in one line, and keeps its size.

Every text of every message that the window receives is forged, and every widget of every window is looked at.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from types import SimpleNamespace

import genpy
import pytest
import roslib.message
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QAbstractButton, QComboBox, QLabel, QMenu, QTabBar, QWidget

import gui
from gui.app.controller import Controller
from gui.app.sign_in import SignInPage
from gui.app.tabs import RobotTabs
from gui.driving.help_overlay import HelpOverlay
from gui.driving.key_legend import KeyLegend
from gui.robots import ROBOTS
from gui.ros.channels import Answer
from gui.window import OperatorWindow, style_sheet
from telepresence.security.outside_text import LONGEST, clean
from telepresence.teleop.lease_messages import PILOT, Account

FOLDER = Path(gui.__file__).parent
HTML = "<img src='/dev/zero'>&Exit <b>big</b>"
FORGED = {
    "html": HTML,
    "escapes": "\x1b]0;owned\x07\x1b[2J\x9b31m\r\n\t\x00",
    "bidi": "\u202egnp.exe\u2066\u200f\u200b\ufeff",
    "surrogates": "\ud800 \udfff",
    "huge": "W" * 1_000_000,
    "lines": "one\ntwo\u2028three\n" * 10_000,
}
UNSEEN = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u200b\u200f\u2028\u202a-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
LONGEST_SHOWN = 2100


def forge(message, text):
    """Put the text into every string of the message."""
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        value = getattr(message, name)
        if kind == "string":
            setattr(message, name, text)
        elif kind == "string[]":
            setattr(message, name, [text, f"{text} (pilot)", "/elsewhere"])
        elif isinstance(value, genpy.Message):
            forge(value, text)
        elif value == [] and "/" in kind and (found := roslib.message.get_message_class(kind.partition("[")[0])):
            setattr(message, name, [forge(found(), text)])
    return message


def forged(row, text):
    return forge(roslib.message.get_message_class(row.kind)(), text)


def texts(widget):
    """What a widget shows, and what it shows when one points at it."""
    yield widget.windowTitle()
    yield widget.toolTip()
    yield widget.accessibleName()
    yield widget.accessibleDescription()
    if isinstance(widget, (QLabel, QAbstractButton)):
        yield widget.text()
    if isinstance(widget, QComboBox):
        for index in range(widget.count()):
            yield widget.itemText(index)
            yield widget.itemData(index, Qt.ItemDataRole.ToolTipRole) or ""
    if isinstance(widget, QTabBar):
        for index in range(widget.count()):
            yield widget.tabText(index)
            yield widget.tabToolTip(index)
    if isinstance(widget, QMenu):
        yield from (action.text() for action in widget.actions())


def tips(widget):
    yield widget.toolTip()
    if isinstance(widget, QComboBox):
        yield from (widget.itemData(index, Qt.ItemDataRole.ToolTipRole) or "" for index in range(widget.count()))
    if isinstance(widget, QTabBar):
        yield from map(widget.tabToolTip, range(widget.count()))


def captions(widget):
    if isinstance(widget, QAbstractButton):
        yield widget.text()
    if isinstance(widget, QMenu):
        yield from (action.text() for action in widget.actions())
    if isinstance(widget, QTabBar):
        yield from map(widget.tabText, range(widget.count()))


def look_at(window):
    """Fail if a widget of the window would take a text for markup, or shows what cannot be seen."""
    for widget in (window, *window.findChildren(QWidget)):
        if isinstance(widget, QLabel) and not isinstance(widget.parent(), KeyLegend):
            assert widget.textFormat() == Qt.TextFormat.PlainText, (widget.objectName(), widget.text())
        for text in texts(widget):
            assert not UNSEEN.search(text), (widget, text)
            assert len(text) <= LONGEST_SHOWN, widget
        for text in tips(widget):
            assert "<" not in text.removeprefix("<qt>").removesuffix("</qt>"), (widget, text)
        for text in captions(widget):
            assert "Exit" not in text or "&Exit" not in text.replace("&&", ""), (widget, text)


@pytest.fixture
def open_page(qt, make_link, make_terminal):
    pages = []

    def open_one(profile):
        link, terminal = make_link(profile), make_terminal()
        page = OperatorWindow(terminal)
        page.setStyleSheet(style_sheet("dark"))
        controller = Controller(page, link, terminal)
        controller.admit(Account("anna", PILOT))
        link.become(master=True, joined=True, driver=True, feed=True)
        page.resize(1280, 720)
        page.show()
        pages.append(page)
        return page, link, controller

    yield open_one
    for page in pages:
        page.close()
        page.deleteLater()


@pytest.mark.parametrize("kind", FORGED)
@pytest.mark.parametrize("profile", ROBOTS)
def test_every_text_of_every_message_is_shown_literally(open_page, qt, profile, kind):
    page, link, controller = open_page(profile)
    qt.processEvents()
    before = page.minimumSizeHint()
    for channel in link.channels.values():
        channel.wanted = True
        channel.post(forged(channel.row, FORGED[kind]))
        qt.processEvents()
        if channel.row.channel == "lease":
            controller.bar._fill_menu()
            look_at(page)
    link.trouble.emit(f"a {FORGED[kind]}")
    page.status.say(f"Saved /home/{FORGED[kind]}.png", "good")
    page.robotPanel.answer(clean(FORGED[kind]))
    for deck in range(page.deck.count()):
        page.deck.setCurrentIndex(deck)
        qt.processEvents()
    page.grab()
    look_at(page)
    after = page.minimumSizeHint()
    assert after.width() <= max(before.width(), 1280) and after.height() <= max(before.height(), 720), (before, after)
    if kind == "html":
        shown = [label.text() for label in page.findChildren(QLabel)]
        assert any(HTML in text for text in shown), shown


@pytest.mark.parametrize("profile", ROBOTS)
def test_every_answer_of_every_service_is_clean(profile):
    for row in ROBOTS[profile].services:
        response = roslib.message.get_service_class(row.kind)._response_class()
        for text in FORGED.values():
            answer = row.read(forge(response, text))
            assert isinstance(answer, Answer)
            assert not UNSEEN.search(answer.text) and len(answer.text) <= LONGEST, row.name


def test_names_of_robots_and_people_are_shown_literally(open_page, qt):
    tabs = RobotTabs([(HTML, open_page("pepper")[0]), ("Robotino", open_page("robotino")[0])])
    tabs.show()
    qt.processEvents()
    look_at(tabs)
    assert tabs._tabs[0].tabText(0).replace("&&", "&") == HTML
    tabs.close()
    tabs.deleteLater()


def test_the_help_and_the_sign_in_page_show_plain_text(open_page, qt):
    page, *_ = open_page("pepper")
    overlay = next(iter(page.findChildren(HelpOverlay)), None)
    if overlay is not None:
        overlay.open()
    look_at(page)
    sign_in = SignInPage(SimpleNamespace(all=lambda: [1]))
    sign_in.show()
    sign_in.say(HTML)
    qt.processEvents()
    look_at(sign_in)
    assert sign_in.signInMessage.text() == HTML
    sign_in.close()
    sign_in.deleteLater()


@pytest.mark.parametrize("file", sorted(FOLDER.glob("**/*.py")), ids=lambda file: file.stem)
def test_labels_are_those_that_show_plain_text(file):
    """No other label of Qt's, and nothing else that reads HTML. The caps of the keys are HTML of our own."""
    if file.name == "label.py":
        return
    names = {node.id for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Name)}
    assert not names & {"QLabel", "QMessageBox", "QErrorMessage", "QToolTip", "QTextBrowser", "QWhatsThis"}
    calls = {node.attr for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Attribute)}
    assert "setHtml" not in calls and ("setTextFormat" not in calls or file.name == "key_legend.py")


def test_the_files_of_the_designer_have_no_other_labels():
    for file in FOLDER.glob("**/*.ui"):
        text = file.read_text()
        assert 'class="QLabel"' not in text and "RichText" not in text, file
