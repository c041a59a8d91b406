from __future__ import annotations

import pytest
from telepresence_1 import network
from telepresence_1.network import (
    NoRoute,
    address_for_tablet,
    choose_address,
    host_of,
    is_loopback,
    local_address_towards,
)


@pytest.mark.parametrize(
    ("robot", "host"),
    [
        ("192.168.1.7", "192.168.1.7"),
        ("pepper.local:9559", "pepper.local"),
        ("tcp://192.168.1.7:9559", "192.168.1.7"),
        ("tcps://[fe80::1]:9503", "fe80::1"),
    ],
)
def test_finds_the_host_in_what_people_type(robot: str, host: str) -> None:
    assert host_of(robot) == host


def test_the_way_to_a_simulated_robot_is_loopback() -> None:
    assert local_address_towards("127.0.0.1") == "127.0.0.1"
    assert local_address_towards("tcp://localhost:9559") in ("127.0.0.1", "::1")


def test_an_unknown_robot_is_named_in_the_error() -> None:
    with pytest.raises(NoRoute, match=r"'pepper\.invalid'"):
        local_address_towards("pepper.invalid")


@pytest.mark.parametrize(
    ("wanted", "own", "chosen"),
    [
        ("", "", "127.0.0.1"),  # a simulated robot
        ("", "127.0.0.1", "127.0.0.1"),
        ("", "192.0.2.7", "127.0.0.1"),  # roscore runs on another machine
        ("", "pilot.invalid", "127.0.0.1"),
        ("0.0.0.0", "192.0.2.7", "0.0.0.0"),
    ],
)
def test_chooses_an_address_that_the_robot_can_reach(wanted: str, own: str, chosen: str) -> None:
    assert choose_address(wanted, own, "127.0.0.1") == chosen


def test_loopback_is_recognised() -> None:
    assert all(map(is_loopback, ("127.0.0.1", "127.9.9.9", "::1", "localhost")))
    assert not any(map(is_loopback, ("192.168.1.7", "0.0.0.0", "pilot")))


@pytest.mark.parametrize(
    ("served", "own", "asked"),
    [
        ("10.88.0.3", "192.0.2.7", "192.0.2.7"),  # the host, which publishes the port
        ("10.88.0.3", "pilot.example", "pilot.example"),
        ("127.0.0.1", "127.0.0.1", "127.0.0.1"),  # a simulated robot inside
        ("10.88.0.3", "", "10.88.0.3"),
        ("0.0.0.0", "", "127.0.0.1"),
    ],
)
def test_from_a_container_the_tablet_asks_the_host(
    monkeypatch: pytest.MonkeyPatch, served: str, own: str, asked: str
) -> None:
    monkeypatch.setattr(network, "in_image", lambda: True)
    assert address_for_tablet(served, own, "127.0.0.1") == asked


def test_elsewhere_the_tablet_asks_where_the_page_is() -> None:
    assert address_for_tablet("127.0.0.1", "192.0.2.7", "127.0.0.1") == "127.0.0.1"
    assert address_for_tablet("0.0.0.0", "192.0.2.7", "127.0.0.1") == "127.0.0.1"
