"""Which key the programs on the robot take, and that they listen for nobody but their own machine without one."""

from __future__ import annotations

import pytest
from rto_bringup.onboard.__main__ import find_key, main, parse

from telepresence.security.robot_key import RobotKey

ROLES = ("drive", "camera", "sound")


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("address", ["0.0.0.0", "::", "192.0.2.1"])
def test_without_a_key_nothing_listens_where_strangers_are(role, address, capsys):
    assert main([role, "--port", "0", "--address", address]) == 1
    said = capsys.readouterr().err
    assert "without a key" in said and "--key FILE" in said and "make_bundle.py" in said


@pytest.mark.parametrize("role", ROLES)
def test_a_key_that_others_can_read_is_refused(role, tmp_path, capsys):
    path = tmp_path / "robot.key"
    RobotKey.make(path)
    path.chmod(0o644)
    assert main([role, "--port", "0", "--key", str(path)]) == 1
    assert "chmod 600" in capsys.readouterr().err


@pytest.mark.parametrize("role", ROLES)
def test_the_key_is_that_of_the_file(role, tmp_path):
    key = RobotKey.make(tmp_path / "robot.key")
    words = [role, "--key", str(tmp_path / "robot.key")]
    assert find_key(parse([*words, "--address", "0.0.0.0"])) == key
    assert find_key(parse(words)) == key, "on loopback too"
    assert find_key(parse([role])) is None, "a simulated robot needs none"
