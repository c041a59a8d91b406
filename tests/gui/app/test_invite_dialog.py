"""The window's links: made, shown as a code that phones read, copied, listed, withdrawn; only for who may invite."""

from __future__ import annotations

import sqlite3

import cv2
import numpy as np
import pytest
from PyQt5.QtGui import QImage

from gui.app import invite_dialog
from gui.app.authorization import Authorization
from gui.app.controller import Controller
from gui.app.invite_dialog import FAILED, InviteDialog
from gui.theme import application, style_sheet
from gui.window import OperatorWindow
from telepresence.teleop.accounts import PILOT, WATCHER, Account
from telepresence.teleop.invitations import GUEST_RANK, InvitationError, Invitations, beside
from telepresence.teleop.key_agreement import OPEN

ADDRESS = "https://192.0.2.7:8443/"


@pytest.fixture
def invitations(tmp_path):
    invitations = Invitations(beside(tmp_path / "users.db"))
    invitations.set_page(ADDRESS)
    return invitations


@pytest.fixture
def dialog(qt, invitations, monkeypatch):
    monkeypatch.setattr(invite_dialog, "REFRESH_PERIOD", 50)
    dialog = InviteDialog(invitations)
    dialog.open_for("anna")
    yield dialog
    dialog.hide()


def rows(dialog):
    return [dialog.links.item(index).text() for index in range(dialog.links.count())]


def read_code(dialog):
    """What a phone's camera reads."""
    shown = dialog.code.grab().toImage().convertToFormat(QImage.Format_Grayscale8)
    data = shown.constBits().asstring(shown.byteCount())
    pixels = np.frombuffer(data, np.uint8).reshape(shown.height(), shown.bytesPerLine())[:, : shown.width()]
    return cv2.QRCodeDetectorAruco().detectAndDecode(np.ascontiguousarray(pixels))[0]


def test_a_link_is_made_shown_copied_used_and_withdrawn(dialog, invitations, spin):
    dialog.setStyleSheet(style_sheet("dark"))
    dialog.roleChoice.setCurrentIndex(dialog.roleChoice.findData(PILOT))
    dialog.timeChoice.setCurrentIndex(0)
    dialog.onceBox.setChecked(True)
    assert not dialog.made.isVisible()
    dialog.makeButton.click()
    spin(dialog.made.isVisible, "the link is shown")
    link = dialog.linkField.text()
    assert link.startswith(f"{ADDRESS}#i=") and read_code(dialog) == link
    assert dialog.madeLabel.text() == "The first who opens it drives a free robot for 30 min from now."
    dialog.copyButton.click()
    assert application().clipboard().text() == link
    spin(lambda: rows(dialog) == ["Drives for 30 min, once; not used yet; made by anna"], "it is listed")
    guest, made = invitations.use(link.partition("#i=")[2], "Lena", OPEN.lease)
    assert (guest.role, made.maker) == (PILOT, "anna")
    assert not dialog.withdrawButton.isEnabled(), "nothing is chosen"
    dialog.links.setCurrentRow(0)
    spin(lambda: rows(dialog)[0].endswith("; used; made by anna"), "it has been used")
    assert dialog.withdrawButton.isEnabled(), "the list was filled again"
    dialog.withdrawButton.click()
    spin(lambda: rows(dialog) == [], "it is gone")
    spin(lambda: not dialog.made.isVisible(), "and shown no more")
    assert invitations.guests() == {}
    with pytest.raises(InvitationError):
        invitations.use(link.partition("#i=")[2], "Lena", OPEN.lease)


def test_who_comes_next_sees_no_link_of_before(dialog, spin):
    dialog.makeButton.click()
    dialog.hide()  # before the file has answered
    spin(dialog.makeButton.isEnabled, "it has answered")
    dialog.open_for("ben")
    spin(lambda: rows(dialog) == ["Watches for 2 h; not used yet; made by anna"], "it is listed")
    assert not dialog.made.isVisible() and dialog.linkField.text() == ""


def test_what_cannot_be_done_is_said(qt, tmp_path, spin):
    dialog = InviteDialog(Invitations(tmp_path / "invitations"))
    dialog.open_for("anna")
    dialog.makeButton.click()
    spin(lambda: "./stack up" in dialog.inviteMessage.text(), "no page was started")
    assert dialog.inviteMessage.property("level") == "bad" and not dialog.made.isVisible()
    dialog.hide()


def test_an_error_that_nobody_foresaw_leaves_a_button_that_works(dialog, invitations, monkeypatch, spin, caplog):
    invite = invitations.invite

    def fail(*_arguments):
        monkeypatch.setattr(invitations, "invite", invite)
        raise OSError("the disk is gone")

    monkeypatch.setattr(invitations, "invite", fail)
    dialog.makeButton.click()
    spin(lambda: dialog.inviteMessage.text() == FAILED, "it is said")
    assert dialog.makeButton.isEnabled() and "OSError: the disk is gone" in caplog.text
    dialog.makeButton.click()
    spin(dialog.made.isVisible, "the next link is made")


def test_the_window_answers_while_another_program_holds_the_file(dialog, invitations, spin):
    spin(lambda: invitations.path.exists(), "the file is there")
    holder = sqlite3.connect(invitations.path, isolation_level=None)
    holder.execute("BEGIN EXCLUSIVE")
    dialog.makeButton.click()
    spin(lambda: not dialog.makeButton.isEnabled() and not dialog.made.isVisible(), "it waits")
    holder.execute("ROLLBACK")
    holder.close()
    spin(dialog.made.isVisible, "the link is made")


@pytest.mark.parametrize(
    ("account", "may"),
    [
        (Account("anna", PILOT), True),
        (Account("will", WATCHER), False),
        (Account("Lena (guest)", PILOT, GUEST_RANK), False),
    ],
    ids=["a pilot", "a watcher", "a guest"],
)
def test_the_button_is_for_pilots_with_an_account(link, terminal, tmp_path, monkeypatch, account, may):
    monkeypatch.setenv("TELEPRESENCE_USERS", str(tmp_path / "users.db"))
    window = OperatorWindow(terminal)
    controller = Controller(window, link, terminal)
    authorization = Authorization(window, terminal, [controller], None)
    authorization.admit(account)
    link.become(master=True, joined=True, driver=True)
    controller.bar._fill_menu()
    entries = [action for action in controller.bar.menuButton.menu().actions() if action.text() == "Invite somebody"]
    assert controller.bar.inviteButton.isVisibleTo(window) is bool(entries) is may
    controller.bar.inviteButton.click()
    assert authorization.invite_dialog.isVisible() is may
    controller.dismiss()
    authorization.invite_dialog.hide()
