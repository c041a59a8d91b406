"""What the window remembers."""

import threading
from functools import partial

import pytest
from fake_window_parts import FakeLink
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QMainWindow, QSplitter, QTextEdit

import gui.settings
from gui.__main__ import authorize, make_tabs, one_window, parse, remember_driving, save
from gui.ros.node import RosNode
from gui.settings import Settings, default_file


@pytest.fixture
def make_window(qt):
    opened = []

    def make():
        window = QMainWindow()
        splitter = QSplitter()
        splitter.setObjectName("columns")
        splitter.addWidget(QTextEdit())
        splitter.addWidget(QTextEdit())
        window.setCentralWidget(splitter)
        window.resize(640, 400)
        window.show()
        window.columns = splitter
        opened.append(window)
        return window

    yield make
    for window in opened:
        window.close()


def remember(path, window):
    settings = Settings(path)
    settings.save_window(window)
    settings.close()


def test_values_survive_a_restart(tmp_path):
    path = tmp_path / "deep" / "window.ini"
    settings = Settings(path)
    settings.save("theme", "light")
    settings.save("pepper/speed", 0.35)
    settings.close()
    assert Settings(path).text("theme") == "light" and Settings(path).number("pepper/speed", 0.2) == 0.35


@pytest.mark.parametrize("content", ["", "nonsense", "[pepper]\nspeed=fast\n", "[window]\ngeometry=@Variant(bad)\n"])
def test_a_damaged_file_is_as_if_there_were_none(tmp_path, make_window, content):
    path = tmp_path / "window.ini"
    path.write_text(content)
    assert Settings(path).number("pepper/speed", 0.2) == 0.2 and Settings(path).text("theme", "dark") == "dark"
    assert not Settings(path).restore_window(make_window())


def test_a_window_comes_back_as_it_was(tmp_path, make_window):
    first = make_window()
    first.resize(700, 450)
    first.columns.setSizes([200, 500])
    remember(tmp_path / "window.ini", first)
    second = make_window()
    assert Settings(tmp_path / "window.ini").restore_window(second)
    assert (second.width(), second.height()) == (700, 450)
    assert second.columns.sizes() == first.columns.sizes()


def test_a_file_is_written_only_when_something_has_changed(tmp_path, make_window):
    """The window looks every few seconds whether there is something to remember."""
    path, window = tmp_path / "window.ini", make_window()
    settings = Settings(path)
    settings.save("name", "anna")
    settings.save_window(window)
    settings.close()
    assert Settings(path).text("name") == "anna"
    path.unlink()
    settings.save("name", "anna")
    settings.save_window(window)
    settings.close()
    assert not path.exists()
    window.resize(700, 450)
    settings.save_window(window)
    settings.close()
    assert path.exists()


def test_a_window_does_not_wait_for_a_busy_disk(tmp_path, monkeypatch, wait_until):
    path, free, wrote = tmp_path / "window.ini", threading.Event(), []
    write = gui.settings._write

    def write_late(*arguments):
        wrote.append(arguments)
        free.wait(30.0)
        write(*arguments)

    monkeypatch.setattr("gui.settings._write", write_late)
    settings = Settings(path)
    settings.save("name", "anna")
    settings.write()
    wait_until(lambda: wrote, "it is being written")
    for name in ("bert", "carl"):
        settings.save("name", name)
        settings.write()
    assert settings.text("name") == "carl" and len(wrote) == 1
    free.set()
    wait_until(lambda: Settings(path).text("name") == "carl", "what changed meanwhile is written, too")
    assert len(wrote) == 2


def test_a_window_that_fills_a_small_screen_stays_there_without_a_title_bar(tmp_path, make_window):
    """Without a window manager, as offscreen, nobody moves it back."""
    first, second = make_window(), make_window()
    for window in (first, second):
        window.showMaximized()
        window.setGeometry(window.screen().availableGeometry())
    first.columns.setSizes([200, 500])
    remember(tmp_path / "window.ini", first)
    assert Settings(tmp_path / "window.ini").restore_window(second)
    assert second.geometry() == second.screen().availableGeometry()
    assert second.columns.sizes() == first.columns.sizes()


def test_nothing_is_remembered_when_not_wanted(monkeypatch, tmp_path):
    monkeypatch.setenv("TELEPRESENCE_SETTINGS", "none")
    assert default_file() is None
    Settings(None).save("theme", "light")
    assert Settings(None).text("theme", "dark") == "dark"
    monkeypatch.setenv("TELEPRESENCE_SETTINGS", "")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert default_file() == tmp_path / "telepresence" / "window.ini"


def test_keys_as_in_the_guide_hold_for_both_robots_and_are_remembered(tmp_path, qt):
    settings = Settings(tmp_path / "window.ini")
    opened = []

    def open_tabs(profile):
        tabs = make_tabs(RosNode(), parse(["--profile", profile, "--no-sign-in"]), settings)
        opened.extend(tabs)
        return tabs

    tabs = open_tabs("both")
    assert not any(tab.controller.bar.guide_keys for tab in tabs)
    tabs[1].controller.bar.set_guide_keys(True)
    assert tabs[0].controller.bar.guide_keys and tabs[0].window.pad._keys[Qt.Key_Q] == "turn_right"
    for tab in tabs:
        tab.save(settings)
    open_tabs("walker")[0].save(settings)  # has no Q and no E, and forgets nothing
    again = open_tabs("robotino")[0]
    assert again.controller.bar.guide_keys and again.controller.controls.turn == pytest.approx(0.05)
    for tab in opened:
        tab.terminal.close_terminal()
        tab.window.deleteLater()


@pytest.mark.parametrize(
    ("profile", "addresses"),
    [("both", ["10.0.0.8", "10.0.0.3"]), ("pepper", ["10.0.0.8"]), ("robotino", ["10.0.0.3"])],
)
def test_nao_ip_is_the_address_of_pepper_alone(tmp_path, qt, monkeypatch, profile, addresses):
    monkeypatch.setenv("NAO_IP", "10.0.0.8")
    settings = Settings(tmp_path / "window.ini")
    settings.save("pepper/address", "10.0.0.2")
    settings.save("robotino/address", "10.0.0.3")
    tabs = make_tabs(RosNode(), parse(["--profile", profile, "--no-sign-in"]), settings)
    assert [tab.window.address.text() for tab in tabs] == addresses
    for tab in tabs:
        tab.terminal.close_terminal()
        tab.window.deleteLater()


@pytest.fixture
def open_window(tmp_path, qt):
    """What main does, as far as it is about what the window remembers; return the window and who says what is in
    front."""
    opened = []

    def open_one(profile):
        settings = Settings(tmp_path / "window.ini")
        tabs = make_tabs(RosNode(), parse(["--profile", profile, "--no-sign-in"]), settings)
        window, front = one_window(tabs, settings)
        authorization = authorize(tabs, window, None)
        remember_driving(tabs, window, partial(save, settings, tabs, window, authorization))
        opened.append((window, tabs))
        return window, front

    yield open_one
    for window, tabs in opened:
        for tab in tabs:
            tab.terminal.close_terminal()
        window.deleteLater()


def test_a_window_that_dies_comes_back_with_what_its_keys_did(tmp_path, open_window, wait_until):
    """What else it remembers is saved every few seconds; until then the next key would drive the other robot."""
    path = tmp_path / "window.ini"
    window, front = open_window("both")
    assert front().link.robot.name == "pepper"
    window.choose(1)
    wait_until(lambda: Settings(path).text("tab") == "robotino", "the tab is remembered")
    front().controller.controls.set_speed(0.05)
    wait_until(lambda: Settings(path).number("robotino/speed", 0.0) == 0.05, "the speed is remembered")
    front().controller.bar.set_guide_keys(True)
    wait_until(lambda: Settings(path).text("keys"), "so are the keys")
    _window, front = open_window("both")
    assert front().link.robot.name == "robotino"
    assert front().controller.controls.speed == pytest.approx(0.05) and front().controller.bar.guide_keys


def test_each_robots_splitters_are_its_own(tmp_path, open_window, qt):
    """With one setting for both, each look whether something has changed wrote first the one, then the other."""

    def columns(window):
        sizes = []
        for index, page in enumerate(window.pages):
            window.choose(index)
            qt.processEvents()
            sizes.append(page.columns.sizes())
        return sizes

    path = tmp_path / "other.ini"
    first, _front = open_window("both")
    first.show()
    usual = columns(first)
    first.pages[0].columns.setSizes([usual[0][0] - 100, usual[0][1] + 100])
    wanted = columns(first)
    assert wanted[0] != wanted[1] == usual[1]
    settings = Settings(path)
    settings.save_window(first)
    settings.close()
    path.unlink()
    settings.save_window(first)
    settings.close()
    assert not path.exists(), "nothing has changed"
    remember(path, first)
    again, _front = open_window("both")
    again.show()
    assert Settings(path).restore_window(again) and columns(again) == wanted
    first.hide()
    again.hide()


def test_a_splitter_is_where_it_was_before_each_robot_had_its_own(tmp_path, make_window):
    path, old, new = tmp_path / "window.ini", make_window(), make_window()
    old.columns.setSizes([200, 400])
    remember(path, old)
    assert "columns=" in path.read_text(), "a window without a robot has the key of old"
    new.setObjectName("pepper")
    assert Settings(path).restore_window(new)
    assert new.columns.sizes() == old.columns.sizes()
    new.columns.setSizes([300, 300])
    remember(path, new)
    again = make_window()
    again.setObjectName("pepper")
    assert Settings(path).restore_window(again)
    assert again.columns.sizes() == new.columns.sizes() != old.columns.sizes()


def test_a_walkers_window_that_dies_comes_back_with_its_red_stop(tmp_path, open_window, monkeypatch, spin):
    """Nobody else holds it: else a program that walks the robot would go on."""
    monkeypatch.setattr("gui.app.robot_tab.RosLink", lambda _node, robot: FakeLink(robot.name))
    path = tmp_path / "window.ini"

    def open_walker():
        tab = open_window("walker")[1]()
        tab.link.become(master=True, joined=True, driver=True, feed=True)
        return tab

    def text(tab):
        return tab.controller.controls.redStop.text()

    first = open_walker()
    assert "STOPPED" not in text(first)
    first.controller.driving.red_stop()
    spin(lambda: Settings(path).text("walker/stopped_by"), "the stop is remembered")
    again = open_walker()
    assert text(again) == text(first) and "STOPPED by" in text(again)
    spin(lambda: again.link.movements.count(0) > 2, "it repeats the stop")
    again.controller.driving.reset_red_stop()
    spin(lambda: not Settings(path).text("walker/stopped_by"), "it is reset for good")
    assert "STOPPED" not in text(open_walker())
