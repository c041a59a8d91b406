"""Command lines that the buttons type."""

import shlex

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gui.terminal import commands
from gui.terminal.commands import Address, parse_address


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("192.168.1.10", Address("192.168.1.10")),
        (" 10.0.0.7 ", Address("10.0.0.7")),
        ("pepper.local", Address("pepper.local")),
        ("nao-2", Address("nao-2")),
        ("127.0.0.1:41000", Address("127.0.0.1", 41000)),
    ],
)
def test_addresses(text, address):
    assert parse_address(text) == address


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "Type the robot's address"),
        ("   ", "Type the robot's address"),
        ("192.168.1", "four numbers"),
        ("192.168.1.300", "four numbers"),
        ("a b", "neither a host name"),
        ("$(reboot)", "neither a host name"),
        ("robot;reboot", "neither a host name"),
        ("-oProxy", "neither a host name"),
        ("pepper:", "not a port"),
        ("pepper:0", "not a port"),
        ("pepper:99999", "not a port"),
        ("pepper:9559:1", "not a port"),
    ],
)
def test_wrong_addresses_say_what_is_wrong(text, part):
    with pytest.raises(ValueError, match=part):
        parse_address(text)


@given(st.text(max_size=40))
def test_no_address_smuggles_a_command_into_the_shell(text):
    try:
        address = parse_address(text)
    except ValueError:
        return
    line = commands.pepper_session(address, "10.0.0.1")
    assert shlex.split(line) == line.split()
    assert set(line) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ._:=-")


def test_session_is_the_documented_command_line():
    line = commands.pepper_session(Address("192.168.1.10"), "192.168.1.2")
    assert line == "roslaunch pepper_bringup tele_pepper.launch nao_ip:=192.168.1.10 roscore_ip:=192.168.1.2"


def test_session_names_an_unusual_port():
    assert commands.pepper_session(Address("127.0.0.1", 41000), "127.0.0.1").endswith(" nao_port:=41000")
    assert "nao_port" not in commands.pepper_session(Address("127.0.0.1", 9559), "127.0.0.1")


@pytest.mark.parametrize(
    ("uri", "line"),
    [
        ("http://localhost:11311", "roscore"),
        ("http://127.0.0.1:11311/", "roscore"),
        ("http://127.0.0.1:21000", "roscore -p 21000"),
    ],
)
def test_roscore_starts_where_the_window_looks_for_it(uri, line):
    assert commands.roscore(uri) == line


def test_own_address_is_the_one_on_the_way_to_the_robot():
    assert commands.own_address_towards("127.0.0.1") == "127.0.0.1"


def test_an_unknown_robot_is_explained():
    with pytest.raises(ValueError, match=r"robot\.invalid cannot be reached"):
        commands.own_address_towards("robot.invalid")


@pytest.mark.parametrize(
    ("name", "taken", "line"),
    [
        ("teleop_twist_keyboard", (), "run"),
        ("teleop_twist_keyboard", ("/teleop_twist_keyboard",), "run name:=teleop_twist_keyboard_2"),
        (
            "keyboard_of_robotino",
            ("/keyboard_of_robotino", "/keyboard_of_robotino_2"),
            "run name:=keyboard_of_robotino_3",
        ),
    ],
)
def test_a_keyboard_gets_a_name_that_no_other_has(name, taken, line):
    assert commands.keyboard("run", name, taken) == line
