"""Addresses of robots' programs, as a person types them."""

import pytest

from telepresence.host_port import parse_host_port


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("10.0.0.7", ("10.0.0.7", 8085)),
        ("robot.local:9000", ("robot.local", 9000)),
        ("fe80::1%eth0", ("fe80::1%eth0", 8085)),
        ("[::1]", ("::1", 8085)),
    ],
)
def test_host_and_port(text, address):
    assert parse_host_port(text, 8085, "a drive server") == address


@pytest.mark.parametrize("text", ["", "192.168..1", "a b", "http://robot", f"{'x' * 64}.local", "robot:0"])
def test_what_no_name_server_takes_is_refused_at_once(text):
    """Asked for, the name with two dots would end the link's thread."""
    with pytest.raises(ValueError, match=r"address|port"):
        parse_host_port(text, 8085, "a drive server")
