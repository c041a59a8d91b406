"""Pepper's drive server: the one file that is copied to the robot, against an ALMotion that notes what it is asked."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from naoqi_driver.onboard.naoqi_link import is_near
from naoqi_driver.onboard.pepper_base import FAR_SPEED, far_motion, far_velocity
from onboard_pepper import drive
from python2_syntax import assert_python_2

from telepresence.drive.link import DriveLink

ROBOT = Path(__file__).resolve().parents[4] / "catkin_ws" / "src" / "naoqi_driver_py" / "robot"


@pytest.fixture
def make_pilot(start, key, naoqi, motion, wait_until) -> Iterator:
    made: list[DriveLink] = []

    def make(*options: str, **environment: str) -> DriveLink:
        made.append(start(f"tcp://127.0.0.1:{naoqi.port}", *options, **environment).link(key))
        wait_until(lambda: state(made[-1]) == "no command", "the server has found NAOqi")
        wait_until(lambda: motion.names() == ["stopMove", "killMove"], "what was left behind does not go on")
        motion.calls.clear()
        return made[-1]

    yield make
    for each in made:
        each.close()


def state(pilot: DriveLink) -> str:
    report = pilot.report()[0]
    return report.state if report else ""


def test_what_runs_on_the_robot_is_also_python_2(maker):
    found = maker.modules([maker.PROGRAM], maker.SOURCES)
    assert {"telepresence.drive.pilots", "telepresence.security.signing", maker.PROGRAM} < set(found)
    for path in found.values():
        assert_python_2(path)
    compile(maker.one_file(), "drive_server.py", "exec")


def test_drives_brakes_hard_in_silence_and_gently_when_let_go(make_pilot, motion, wait_until):
    pilot = make_pilot()
    drive(pilot, motion, wait_until)
    assert motion.calls[-1] == ("move", 0.2, 0.0, 0.1)
    assert pilot.report()[0].allowed == ()
    pilot.release(hard=True)
    wait_until(lambda: motion.names() == ["move", "stopMove", "killMove"], "not standing, it is stopped at once")
    motion.calls.clear()
    drive(pilot, motion, wait_until)
    motion.stands = True
    pilot.release()
    wait_until(lambda: motion.names() == ["move", "stopMove"], "it is let go")
    motion.calls.clear()
    drive(pilot, motion, wait_until)
    motion.stands, pilot._session = False, None  # the pilot dies: no word more
    # A stop that came while `move` was unanswered is sent again, so that one may come before this.
    wait_until(lambda: motion.names()[-3:] == ["move", "stopMove", "killMove"], "nothing is heard from the pilot")


def test_an_almotion_that_hangs_gets_no_second_velocity_and_the_reports_go_on(make_pilot, motion, wait_until):
    pilot = make_pilot()
    motion.hangs = True
    drive(pilot, motion, wait_until)

    def reported() -> bool:
        pilot.drive(-0.2, 0.0, 0.0)
        return state(pilot) == "fault" and "has not answered move" in pilot.report()[0].reason

    wait_until(reported, "the fault is reported")
    assert len(motion.calls) == 1
    pilot.release(hard=True)
    wait_until(lambda: motion.names()[:3] == ["move", "stopMove", "killMove"], "silence brakes all the same")
    wait_until(lambda: motion.names()[3:] == ["stopMove", "killMove"], "again, once the velocity was answered")


def test_a_goal_is_reached_or_ended(make_pilot, motion, wait_until):
    pilot = make_pilot()
    motion.stands = True
    pilot.go_to(0.5, 0.0, 1.0)
    wait_until(lambda: pilot.goal_state() == "driving", "it drives there")
    wait_until(lambda: motion.calls == [("moveTo", 0.5, 0.0, 1.0)], "once")
    motion.arrive(True)
    wait_until(lambda: pilot.goal_state() == "reached", "it is reached")
    pilot.go_to(0.5, 0.0, 1.0)
    wait_until(lambda: motion.names()[-1] == "moveTo" and pilot.goal_state() == "driving", "the next one")
    pilot.end_goal()
    wait_until(lambda: motion.names()[-1] == "stopMove", "nobody wants it any more")


def test_stop_latches_until_it_is_reset_and_the_controls_are_let_go(make_pilot, motion, wait_until):
    pilot = make_pilot()
    drive(pilot, motion, wait_until)
    assert pilot.ask("stop").ok
    wait_until(lambda: state(pilot) == "stopped" and motion.names()[-1] != "move", "it stops")
    assert pilot.ask("reset stop").ok
    pilot.drive(0.2, 0.0, 0.1)
    assert motion.names()[-1] != "move", "the key is still held"
    pilot.release()
    wait_until(lambda: state(pilot) == "no command", "the key is let go")
    drive(pilot, motion, wait_until)


def test_over_a_network_every_motion_ends_by_itself(make_pilot, motion, wait_until):
    pilot = make_pilot("--far")
    drive(pilot, motion, wait_until, "moveTo")
    x, y, theta, duration, _limits = [call for call in motion.calls if call[0] == "moveTo"][-1][1:]
    assert 0.0 < x < 0.1 and y == 0.0 and 0.0 < theta < 0.05 and 0.0 < duration < 1.0
    pilot.release()
    wait_until(lambda: motion.names()[-1] in ("stopMove", "killMove"), "it is let go")
    assert "move" not in motion.names()
    pilot.go_to(1.0, 0.0, 0.0)
    wait_until(lambda: "the goal" in pilot.report()[0].reason, "a long motion is refused")
    assert not any(call[1:2] == (1.0,) for call in motion.calls)


def test_a_far_velocity_keeps_its_direction_and_its_limit():
    assert far_velocity((0.4, 0.0, 0.2)) == pytest.approx((FAR_SPEED, 0.0, 0.2 * FAR_SPEED / 0.4))
    assert far_velocity((0.0, 0.0, 1.0)) == (0.0, 0.0, 1.0)
    x, _, _, duration, limits = far_motion((FAR_SPEED, 0.0, 0.0))
    assert x < FAR_SPEED * duration, "it is not driven at that speed to the end"
    assert dict(limits)["MaxVelXY"] == FAR_SPEED


def test_without_naoqi_it_says_so_and_gives_signs_of_life(start, key, free_port, tmp_path, wait_until):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as station:
        station.bind(str(tmp_path / "notify"))
        station.settimeout(10)
        server = start(f"tcp://127.0.0.1:{free_port()}", NOTIFY_SOCKET=str(tmp_path / "notify"))
        assert station.recv(100) == b"WATCHDOG=1"
    stranger, pilot = server.link(None), server.link(key)
    try:
        wait_until(lambda: state(pilot) == "fault" and "NAOqi is not reachable" in pilot.report()[0].reason, "a fault")
        wait_until(lambda: "wants the robot's key" in stranger.problem, "nobody else gets in")
    finally:
        stranger.close()
        pilot.close()


def test_without_a_key_it_listens_on_loopback_only(folder, tmp_path):
    alone = tmp_path / "drive_server.py"
    alone.write_text((folder / "drive_server.py").read_text())
    refused = subprocess.run(
        [sys.executable, alone, "--address", "0.0.0.0"], capture_output=True, text=True, timeout=20
    )
    assert refused.returncode == 1
    assert "without a key nothing listens on 0.0.0.0" in refused.stderr


def test_the_file_for_the_robot_speaks_no_tls_and_says_what_it_wants_instead(folder):
    refused = subprocess.run(
        [sys.executable, "-S", folder / "drive_server.py", "--port", "0", "--qi-url", "tcps://127.0.0.1:9503"],
        capture_output=True, text=True, timeout=20, env={**os.environ, "PYTHONPATH": ""},
    )  # fmt: skip
    assert refused.returncode == 1
    assert "on the robot itself NAOqi answers at tcp://127.0.0.1:9559" in refused.stderr


@pytest.mark.parametrize(
    ("url", "near"),
    [("tcp://127.0.0.1:9559", True), ("tcp://10.0.0.7:9559", False), ("tcps://127.0.0.1:9503", False)],
)
def test_what_is_near(url, near):
    assert is_near(url) is near


def test_an_address_that_is_none_is_refused():
    with pytest.raises(ValueError, match="tcp://HOST:9559"):
        is_near("pepper")
