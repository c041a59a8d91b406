"""Where we listen for the robot: never on more addresses, and never for a robot on this machine beyond it."""

from __future__ import annotations

import pytest
from naoqi_driver.call_back import AUTOMATIC, check_url, listen_url

HERE, ROBOT = "10.0.0.10", "10.0.0.7"


@pytest.mark.parametrize(
    ("wanted", "here", "robot", "url"),
    [
        (AUTOMATIC, HERE, ROBOT, f"tcp://{HERE}:0"),
        (AUTOMATIC, "127.0.0.1", "127.0.0.1", ""),
        (AUTOMATIC, "127.0.0.1", "127.0.0.9", ""),
        (AUTOMATIC, HERE, HERE, ""),
        (AUTOMATIC, "fe80::1", "fe80::2", ""),
        ("tcp://0.0.0.0:9561", HERE, ROBOT, f"tcp://{HERE}:9561"),
        ("tcp://0.0.0.0:9561", "127.0.0.1", "127.0.0.1", "tcp://127.0.0.1:9561"),
        ("tcp://10.0.0.11:0", HERE, ROBOT, "tcp://10.0.0.11:0"),
        ("tcp://127.0.0.1:0", "127.0.0.1", "127.0.0.1", "tcp://127.0.0.1:0"),
        ("tcp://127.0.0.1:9561", HERE, ROBOT, ""),
        ("tcp://localhost:0", HERE, ROBOT, ""),
    ],
)
def test_it_is_one_address_that_the_robot_reaches(wanted, here, robot, url):
    check_url(wanted)
    assert listen_url(wanted, here, robot, encrypted=False) == url


def test_sound_of_an_encrypted_link_crosses_no_network_in_the_clear_unless_somebody_says_so():
    assert listen_url(AUTOMATIC, HERE, ROBOT, encrypted=True) == ""
    assert listen_url("tcp://0.0.0.0:0", HERE, ROBOT, encrypted=True) == f"tcp://{HERE}:0"


@pytest.mark.parametrize("url", ["10.0.0.10:9561", "tcps://0.0.0.0:0", "http://0.0.0.0:80", "tcp://0.0.0.0:x", "9561"])
def test_what_is_no_address_is_refused(url):
    with pytest.raises(ValueError, match="qi_listen_url"):
        check_url(url)
