"""Which servers a browser is told, and the passwords for them."""

import base64
import hashlib
import hmac

import pytest

from telepresence.page.relays import LIFE, Relays

SECRET = "sixteen letters!"


def test_without_settings_nobody_is_asked():
    assert Relays().for_browser("browser_1", 0.0) == [] == Relays().for_station()


def test_a_relay_is_named_with_a_password_that_ends():
    stun, turn = Relays(["turn:relay.example.org:3478"], SECRET).for_browser("browser_1", 1_800_000_000.9)
    assert stun == {"urls": ["stun:relay.example.org:3478"]}
    assert turn["urls"] == [f"turn:relay.example.org:3478?transport={way}" for way in ("udp", "tcp")]
    assert turn["username"] == f"{1_800_000_000 + LIFE}:browser_1"
    proof = hmac.new(SECRET.encode(), turn["username"].encode(), hashlib.sha1).digest()
    assert base64.b64decode(turn["credential"]) == proof


def test_the_station_asks_for_its_address_only():
    assert [server.urls for server in Relays(["turn:[2001:db8::1]:3478"], SECRET).for_station()] == [
        ["stun:[2001:db8::1]:3478"]
    ]
    assert Relays(["turns:relay.example.org:443"], SECRET).for_station() == []


def test_tls_and_a_named_transport_are_kept():
    servers = Relays(["turns:a.example:443", "turn:b.example?transport=tcp", "stun:c.example"], SECRET)
    stun, turn = servers.for_browser("x", 0.0)
    assert turn["urls"] == ["turns:a.example:443?transport=tcp", "turn:b.example?transport=tcp"]
    assert stun["urls"] == ["stun:b.example", "stun:c.example"]


@pytest.mark.parametrize(
    "uri", ["relay.example.org", "turn:", "turn:a b", "stun:a?transport=udp", "http:a", "turn:a:1\n"]
)
def test_what_names_no_server_is_refused(uri):
    with pytest.raises(ValueError, match="is no stun"):
        Relays([uri], SECRET)


def test_a_relay_needs_a_secret_from_a_file(tmp_path):
    with pytest.raises(ValueError, match="secret"):
        Relays(["turn:a.example"], "short")
    (tmp_path / "secret").write_text(f"{SECRET}\nmore\n")
    read = Relays.read(["turn:a.example"], tmp_path / "secret").for_browser("x", 0.0)
    assert read == Relays(["turn:a.example"], SECRET).for_browser("x", 0.0)
