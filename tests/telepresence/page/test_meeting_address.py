"""At which address of this machine a browser is met. The connections themselves: tests/catkin_ws/pilot_page."""

import socket

import pytest

from telepresence.page import browser_link
from telepresence.page.browser_link import meeting_address

FIREFOX = "v=0\r\no=mozilla...THIS_IS_SDPARTA-99.0 1 0 IN IP4 0.0.0.0\r\n"
OTHER = "v=0\r\no=- 1 2 IN IP4 127.0.0.1\r\ns=mozilla\r\n"


@pytest.fixture
def network(monkeypatch):
    monkeypatch.setattr(browser_link, "address_towards", lambda host: "192.0.2.7")


@pytest.mark.parametrize(
    ("offer", "address", "met"),
    [
        (OTHER, "127.0.0.1", "127.0.0.1"),
        (FIREFOX, "127.0.0.1", "192.0.2.7"),
        (FIREFOX, "::1", "192.0.2.7"),
        (FIREFOX, "192.0.2.9", "192.0.2.9"),
        (FIREFOX, None, None),
    ],
)
def test_firefox_on_this_machine_is_met_where_it_can_reach(network, offer, address, met):
    assert meeting_address(offer, address) == met


def test_without_a_network_there_is_only_loopback(monkeypatch):
    def nowhere(host):
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(browser_link, "address_towards", nowhere)
    assert meeting_address(FIREFOX, "127.0.0.1") == "127.0.0.1"


def test_this_machine_s_own_address_can_be_bound():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        bound.bind((meeting_address(FIREFOX, "127.0.0.1"), 0))
