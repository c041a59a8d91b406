"""The drive server as a program, against the simulated robot's web server."""

from __future__ import annotations

import math
import signal
import socket
from dataclasses import replace

import pytest
from rto_bringup.onboard.__main__ import main
from rto_bringup.onboard.kept_latches import KeptLatches
from rto_bringup.onboard.robotino_base import RobotinoBase
from rto_bringup.onboard.sensors import Reading
from rto_node.client import RobotinoClient

from telepresence.drive.link import DriveLink
from telepresence.drive.pilots import SILENCE, PilotVelocity
from telepresence.drive.server import AT_REST
from telepresence.safety import Latched, Odometry


@pytest.fixture
def make_link(wait_until):
    made = []

    def make(port: int, name: str = "", rank: int = 0) -> DriveLink:
        link = DriveLink(f"127.0.0.1:{port}", name=name, rank=rank)
        made.append(link)
        wait_until(lambda: not link.problem, "the drive server answers")
        return link

    yield make
    for link in made:
        link.close()


@pytest.fixture
def link(make_link, drive_server, simulation, wait_until):
    made = make_link(drive_server.port)
    wait_until(lambda: abs(simulation.robot.snapshot().odometry.vx) < 0.002, "the robot stands")
    return made


def state(link):
    return link.report()[0].state


def given(link):
    return link.report()[0].given


def test_drives_and_lets_go_gently(link, hold, simulation, watch_robot, wait_until):
    driving = hold(link, 0.2, 0.0, 0.0)
    wait_until(lambda: simulation.robot.snapshot().odometry.vx > 0.19, "the robot drives")
    wait_until(lambda: state(link) == "clear", "the gate lets it drive")
    driving.let_go()
    track = watch_robot(simulation, 1.2)
    wait_until(lambda: state(link) == "no command", "nobody drives")
    # 3 cm of the base's own ramp down to 0.12 m/s, and what a tick, a datagram and a write take; fast, 1 cm
    assert 0.025 < math.dist(track[0][1:], track[-1][1:]) < 0.09


class Silent:
    """A pilot whose last velocity came at 0 s, and who is cut off."""

    cut, careful = True, False

    def deadline(self):
        return SILENCE


def test_a_silent_pilot_gets_one_zero_and_then_the_robots_own_watchdog(monkeypatch):
    base, written = RobotinoBase("127.0.0.1:1", laser=False), []
    monkeypatch.setattr(base, "_write", written.append)
    free = replace(base._gate.step(0.0, None, None), vx=0.35)
    monkeypatch.setattr(base._gate, "step", lambda *_: free)
    for step in range(1, 8):
        now = 0.04 * step
        base.step(now, PilotVelocity(0.35, 0.0, 0.0, 0.0) if now < SILENCE else None, None, Silent())
    braked = written.index(AT_REST)
    assert written.count(AT_REST) == 1 and braked == len(written) - 1, "every other one would keep the motors running"


def test_who_lets_go_gets_the_bases_own_ramp_until_it_is_slow(monkeypatch):
    base, written = RobotinoBase("127.0.0.1:1", laser=False), []
    monkeypatch.setattr(base, "_write", written.append)
    for speed, seconds in ((0.35, 0.375), (0.25, 0.125), (0.2, 0.0), (0.05, 0.0)):
        written.clear()
        base._give(0.0, (speed, 0.0, 0.0), fast=False)
        for step in range(1, 100):
            base._give(0.01 * step, AT_REST, fast=False)
        assert written.count(AT_REST) == pytest.approx(1 + 100 * seconds, abs=1.1)


def test_stop_latches_until_it_is_reset_and_the_key_let_go(link, hold, wait_until):
    driving = hold(link, 0.0, 0.1, 0.0)
    wait_until(lambda: given(link)[1] > 0.09, "the robot drives")
    assert link.ask("stop").ok
    wait_until(lambda: state(link) == "stopped" and given(link) == (0.0, 0.0, 0.0), "the robot is stopped")
    assert link.ask("reset stop").ok
    wait_until(lambda: "Let go" in link.report()[0].reason, "the key is still held")
    driving.let_go()
    wait_until(lambda: state(link) == "no command", "the key is let go")
    hold(link, 0.0, -0.1, 0.0)
    wait_until(lambda: given(link)[1] < -0.09, "the robot drives again")


def test_a_velocity_that_is_not_finite_stops_the_robot(link, wait_until):
    def drives():
        link.drive(0.0, 0.1, 0.0)
        return given(link)[1] > 0.05

    wait_until(drives, "the robot drives")
    with pytest.raises(ValueError, match="nan"):
        link.drive(math.nan, 0.0, 0.0)
    seq = link.report()[0].seq
    wait_until(lambda: link.report()[0].seq > seq + 1, "two more reports")
    assert given(link) == (0.0, 0.0, 0.0)


def test_a_flood_of_noise_disturbs_nobody(link, drive_server, hold, wait_until):
    hold(link, 0.0, 0.1, 0.0)
    wait_until(lambda: given(link)[1] > 0.09, "the robot drives")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as noise:
        for count in range(2000):
            noise.sendto(b"\x00noise" * (count % 200), ("127.0.0.1", drive_server.port))
    seq = link.report()[0].seq
    wait_until(lambda: link.report()[0].seq > seq + 10, "reports go on")
    wait_until(lambda: given(link)[1] > 0.09 and not link.problem, "the robot drives on")


def test_two_pilots(link, make_link, drive_server, hold, wait_until):
    other = make_link(drive_server.port, "other@elsewhere")
    hold(link, 0.0, 0.1, 0.0)
    wait_until(lambda: given(link)[1] > 0.09, "the first drives")
    driving = hold(other, 0.0, -0.1, 0.0)
    wait_until(lambda: "Another pilot drives" in other.report()[0].reason, "the second is told")
    wait_until(lambda: given(link)[1] > 0.09, "the first drives on")
    assert not other.ask("reset stop").ok
    assert other.ask("stop").ok, "anybody may stop"
    wait_until(lambda: state(link) == "stopped", "the robot is stopped")
    assert not link.ask("reset stop").ok, "who pressed it resets it"
    assert other.ask("reset stop").ok
    driving.let_go()


def test_leaves_the_robot_to_others_when_nobody_drives(link, simulation, hold, wait_until):
    """REST has no lock; a drive server that sent zeros for ever would be a bad neighbour."""
    wait_until(lambda: state(link) == "no command", "nobody drives")
    with_rest = RobotinoClient(simulation.url)

    def driven():
        with_rest.drive(0.0, 0.0, 0.3)
        return simulation.robot.snapshot().odometry.omega > 0.25

    wait_until(driven, "another client of the web server drives")
    with_rest.drive(0.0, 0.0, 0.0)
    with_rest.close()


def test_a_robot_whose_web_server_is_gone_is_a_fault_that_says_so(run_onboard, make_link, free_port, wait_until):
    server = run_onboard("drive", "--port", "0", "--robot", f"127.0.0.1:{free_port()}")
    link = make_link(server.port)
    wait_until(lambda: "connection refused" in link.report()[0].reason, "the reason reaches the pilot")
    assert state(link) == "fault"
    assert server.end() == 0
    wait_until(lambda: "no program listens" in link.problem, "the pilot learns that the server has ended")


def test_a_terminated_server_stops_the_robot_first(simulation, run_onboard, make_link, hold, wait_until):
    server = run_onboard("drive", "--port", "0", "--robot", simulation.url)
    link = make_link(server.port)
    hold(link, 0.0, 0.0, 0.5)
    wait_until(lambda: simulation.robot.snapshot().odometry.omega > 0.4, "the robot turns")
    server.process.send_signal(signal.SIGTERM)
    assert server.process.wait(5) == 0
    wait_until(lambda: abs(simulation.robot.snapshot().odometry.omega) < 0.01, "the robot stands")


def test_a_stop_outlasts_the_server_until_somebody_resets_it(simulation, run_onboard, make_link, wait_until):
    server = run_onboard("drive", "--port", "0", "--robot", simulation.url)
    link = make_link(server.port)
    wait_until(lambda: state(link) == "no command", "nothing is stopped")
    assert link.ask("stop").ok
    wait_until(lambda: state(link) == "stopped", "the robot is stopped")
    began = link.report()[0].started
    server.process.kill()
    server.process.wait()
    server = run_onboard("drive", "--port", str(server.port), "--robot", simulation.url)
    wait_until(lambda: link.report()[0].started > began and state(link) == "stopped", "the next server is stopped, too")
    other = make_link(server.port, "other@elsewhere", rank=1)
    assert other.ask("reset stop").ok, "a higher rank resets it"
    seq = other.report()[0].seq
    wait_until(lambda: link.report()[0].seq > seq + 20, "a second passes")
    assert state(link) == "no command", "and nobody presses it again"


def test_a_bump_and_a_stop_outlast_a_server_that_dies_and_whoever_pressed_it(
    simulation, run_onboard, make_link, tmp_path, wait_until
):
    options = ("drive", "--robot", simulation.url, "--kept", str(tmp_path / "latched"), "--port")

    def bumped(pilot):
        pilot.drive(0.0, 0.05, 0.0)
        return "umper" in pilot.report()[0].reason

    server = run_onboard(*options, "0")
    link = make_link(server.port, "chief@elsewhere", rank=5)
    simulation.robot.press_bumper(True)
    wait_until(lambda: bumped(link), "the bumper is felt")
    simulation.robot.press_bumper(False)
    assert link.ask("stop").ok
    link.close()
    server.process.kill()
    server.process.wait()
    server = run_onboard(*options, "0")
    other = make_link(server.port)
    wait_until(lambda: state(other) == "stopped", "what somebody stopped who has gone stays stopped")
    assert other.ask("reset stop").ok
    wait_until(lambda: state(other) == "no command", "the controls are let go")
    wait_until(lambda: bumped(other), "and the bump holds, too")
    assert other.ask("reset bumper").ok
    wait_until(lambda: not bumped(other), "until it is reset")
    assert server.end() == 0
    assert not (tmp_path / "latched").exists(), "a server that ends in order keeps nothing"


@pytest.mark.parametrize("kept", [b"", b"{", b"[]", b'{"stopped": 1, "bumped": true}', b"\xff"])
def test_what_cannot_be_read_counts_as_a_bump(kept, tmp_path):
    path = tmp_path / "latched"
    path.write_bytes(kept)
    path.chmod(0o600)
    assert KeptLatches(path).read().bumped
    assert KeptLatches(tmp_path / "none").read() == KeptLatches(None).read() == Latched()


class Driving:
    """A pilot whose commands come in time."""

    cut, careful = False, False

    def deadline(self):
        return math.inf


@pytest.mark.parametrize("then", [(0.0, 0.0, 0.0), (-0.1, 0.0, 0.0)])
def test_a_newer_command_counts_though_the_report_it_answers_was_late(monkeypatch, then):
    """Its stamp is reckoned from when the pilot received that report."""
    base = RobotinoBase("127.0.0.1:1", laser=False)
    monkeypatch.setattr(base, "_write", lambda _velocity: None)

    def step(now, velocity, stamp):
        base._store(Reading(now, (0.4,) * 9, False, Odometry(0.0, 0.0, 0.0, now), None))
        return base.step(now, PilotVelocity(*velocity, stamp), None, Driving()).given[0]

    for number in range(30):
        now = 10.0 + 0.05 * number
        driven = step(now, (0.1, 0.0, 0.0), now)
    assert driven > 0.05
    assert step(now + 0.05, then, now - 0.05) < driven - 0.01


def test_systemd_learns_that_it_is_ready_and_that_it_lives(run_onboard, simulation, tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(30.0)
        options = ("drive", "--port", "0", "--robot", simulation.url)
        server = run_onboard(*options, NOTIFY_SOCKET=str(tmp_path / "notify"))
        assert [systemd.recv(100) for _ in range(3)] == [b"READY=1", b"WATCHDOG=1", b"WATCHDOG=1"]
        assert server.end() == 0


def test_a_taken_port_is_named(capsys):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        assert main(["drive", "--port", str(port)]) == 1
    assert f"udp port {port}" in capsys.readouterr().err
