"""Addresses of drive servers, as a person types them."""

import pytest

from telepresence.drive.datagram import DEFAULT_PORT
from telepresence.drive.link_ends import parse_address


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("10.0.0.7", ("10.0.0.7", DEFAULT_PORT)),
        ("robot.local:9000", ("robot.local", 9000)),
        ("fe80::1%eth0", ("fe80::1%eth0", DEFAULT_PORT)),
        ("[::1]", ("::1", DEFAULT_PORT)),
    ],
)
def test_host_and_port(text, address):
    assert parse_address(text) == address


@pytest.mark.parametrize("text", ["", "192.168..1", "a b", "http://robot", f"{'x' * 64}.local", "robot:0"])
def test_what_no_name_server_takes_is_refused_at_once(text):
    """Asked for, the name with two dots would end the link's thread."""
    with pytest.raises(ValueError, match=r"address|port"):
        parse_address(text)
