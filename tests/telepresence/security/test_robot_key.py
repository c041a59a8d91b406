"""The key of a robot in its file and in the pilot's store."""

from __future__ import annotations

import os
import stat

import pytest

from telepresence.security.robot_key import RobotKey, host_of, is_loopback, paired, path_of


@pytest.fixture(autouse=True)
def store(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    return tmp_path / "config" / "telepresence" / "keys"


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_a_key_is_made_once_and_read_by_its_owner(tmp_path):
    path = tmp_path / "robot" / "robot.key"
    before = os.umask(0)
    try:
        key = RobotKey.make(path)
    finally:
        os.umask(before)
    assert (mode(path), mode(path.parent)) == (0o600, 0o700)
    assert RobotKey.read(path) == key and RobotKey.parse(key.text) == key
    with pytest.raises(FileExistsError):
        RobotKey.make(path)
    assert RobotKey.read(path) == key
    assert RobotKey.make(tmp_path / "other.key") != key


def test_a_key_does_not_show_itself(tmp_path):
    key = RobotKey.make(tmp_path / "robot.key")
    assert key.text not in repr(key) and key.fingerprint in repr(key)
    assert key.fingerprint not in key.text


def test_macs_are_for_one_key_one_purpose_and_these_parts():
    key, other = RobotKey(bytes(32)), RobotKey(bytes(31) + b"\1")
    mac = key.mac("offer", b"nonce", b"/camera")
    assert len(mac) == 32 and key.matches(mac, "offer", b"nonce", b"/camera")
    assert not key.matches(mac, "answer", b"nonce", b"/camera")
    assert not key.matches(mac, "offer", b"nonce/", b"camera")
    assert not key.matches(mac[:16], "offer", b"nonce", b"/camera")
    assert not other.matches(mac, "offer", b"nonce", b"/camera")


@pytest.mark.parametrize("permissions", [0o640, 0o604, 0o620, 0o666])
def test_a_key_that_others_can_read_or_change_is_refused(tmp_path, permissions):
    path = tmp_path / "robot.key"
    RobotKey.make(path)
    path.chmod(permissions)
    with pytest.raises(ValueError, match="chmod 600"):
        RobotKey.read(path)


@pytest.mark.parametrize(
    "content", ["", "abc", "0" * 63, "g" * 64, "0" * 66, "0" * 5000, "\u00e9" * 64, "\u0661" * 64],
)  # fmt: skip
def test_a_file_without_a_key_is_refused(tmp_path, content):
    path = tmp_path / "robot.key"
    path.touch(0o600)
    path.write_text(content)
    with pytest.raises(ValueError, match="holds no robot's key"):
        RobotKey.read(path)


def test_links_pipes_folders_and_missing_files_are_refused(tmp_path):
    RobotKey.make(tmp_path / "robot.key")
    (tmp_path / "link.key").symlink_to(tmp_path / "robot.key")
    os.mkfifo(tmp_path / "pipe.key", 0o600)
    with pytest.raises(ValueError, match="symbolic link"):
        RobotKey.read(tmp_path / "link.key")
    for name in ("pipe.key", "."):
        with pytest.raises(ValueError, match="is no file"):
            RobotKey.read(tmp_path / name)
    with pytest.raises(FileNotFoundError, match=r"make_bundle\.py"):
        RobotKey.read(tmp_path / "none.key")


def test_the_store_has_a_key_for_each_robot(store):
    assert RobotKey.of("192.168.0.1") is None and paired() == {}
    key, other = RobotKey(bytes(32)), RobotKey(b"\1" * 32)
    path = key.store("192.168.0.1:8082")
    assert path == store / "192.168.0.1.key" == path_of("192.168.0.1")
    assert (mode(path), mode(store)) == (0o600, 0o700)
    assert RobotKey.of("http://192.168.0.1:80") == key
    assert RobotKey.of("192.168.0.2") is None
    other.store("192.168.0.1")
    assert RobotKey.of("192.168.0.1") == other
    key.store("[FE80::1]:8082")
    assert paired() == {"192.168.0.1": path, "fe80::1": store / "fe80::1.key"}
    assert {each.name for each in store.iterdir()} == {"192.168.0.1.key", "fe80::1.key"}, "nothing else is left"


def test_a_link_in_the_store_is_replaced_and_not_followed(store, tmp_path):
    store.mkdir(parents=True)
    (tmp_path / "victim").write_text("mine")
    (store / "robot.key").symlink_to(tmp_path / "victim")
    with pytest.raises(ValueError, match="symbolic link"):
        RobotKey.of("robot")
    RobotKey(bytes(32)).store("robot")
    assert (tmp_path / "victim").read_text() == "mine" and RobotKey.of("robot") == RobotKey(bytes(32))


@pytest.mark.parametrize("address", ["", "..", "../up", "a/b", "a\0b", "a b", "-x", ".hidden", "x" * 300, "a\n"])
def test_what_is_no_address_names_no_file(address):
    with pytest.raises(ValueError, match="not the address"):
        path_of(f"x/{address}" if address == "a\n" else address)


@pytest.mark.parametrize(
    ("address", "host"),
    [("Robot.local:8082", "robot.local"), ("http://10.0.0.1:80/", "10.0.0.1"), ("::1", "::1"), ("[::1]:80", "::1")],
)
def test_the_host_of_an_address(address, host):
    assert host_of(address) == host


def test_loopback_is_told_from_other_addresses():
    assert is_loopback("127.0.0.1") and is_loopback("127.3.2.1") and is_loopback("::1") and is_loopback("localhost")
    assert not is_loopback("0.0.0.0") and not is_loopback("192.168.0.1") and not is_loopback("::")
