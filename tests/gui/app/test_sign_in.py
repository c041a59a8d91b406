"""The page that asks for name and password."""

import pytest
from PyQt5.QtTest import QSignalSpy

from gui.app.sign_in import FAILED, SignInPage
from telepresence.teleop.accounts import Users
from telepresence.teleop.drive_lease import PILOT

PASSWORD = "a password of anna"


@pytest.fixture
def users(tmp_path):
    users = Users(tmp_path / "users.db")
    users.add("anna", PASSWORD, PILOT, 0)
    return users


@pytest.fixture
def page(qt, users):
    page = SignInPage(users)
    page.show()
    yield page
    page.hide()


def test_an_error_that_nobody_foresaw_leaves_a_page_that_works(page, users, monkeypatch, spin, caplog):
    check = users.check

    def fail(*_arguments, **_options):
        monkeypatch.setattr(users, "check", check)
        raise MemoryError("no room for the hash")

    monkeypatch.setattr(users, "check", fail)
    page.nameField.setText("anna")
    page.passwordField.setText(PASSWORD)
    page.try_sign_in()
    spin(lambda: page.signInMessage.text() == FAILED, "it is said")
    assert page.signInButton.isEnabled() and "MemoryError: no room for the hash" in caplog.text
    signed_in = QSignalSpy(page.signed_in)
    page.passwordField.setText(PASSWORD)
    page.try_sign_in()
    spin(lambda: len(signed_in), "anna signs in")
    assert page.signInMessage.text() == ""
