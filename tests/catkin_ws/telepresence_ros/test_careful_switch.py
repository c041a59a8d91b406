"""The careful scan at the start, chosen by launch arguments or by nobody. Switching is tested with the gates."""

from __future__ import annotations

import subprocess

import pytest

pytestmark = pytest.mark.ros

LASER = "unavailable: With a laser, which sees the way ahead and to the sides, the body does not sway."
CASES = {
    ("rto_node/rto_drive_link",): "on by default",
    ("rto_node/rto_drive_link", "_careful:=false"): "off",
    ("rto_node/rto_drive_link", "_laser:=true", "_careful:=true"): LASER,
    ("rto_safe_teleop/safe_omni_drive", "_laser:=true"): "off by default",
    ("rto_safe_teleop/safe_omni_drive", "_laser:=true", "_careful:=true"): "on",
}


def test_what_counts_until_somebody_switches(graph):
    probe = graph.probe()
    for number, (program, *parameters) in enumerate(CASES):
        graph.run(str(graph.workspace / "lib" / program), *parameters, f"__ns:=/r{number}")
        probe.watch(f"/r{number}/careful", "std_msgs/String", ["data"])
    for number, (case, state) in enumerate(CASES.items()):
        assert probe.newest(f"/r{number}/careful") == [state], case
    refused = probe.call("/r2/set_careful", "std_srvs/SetBool", {"data": True})
    assert refused == [True, {"success": False, "message": LASER.partition(": ")[2]}]


@pytest.mark.parametrize("program", ["rto_node/rto_drive_link", "rto_safe_teleop/safe_omni_drive"])
@pytest.mark.parametrize("chosen", [True, False])
def test_a_choice_outlives_the_program_and_is_no_default(graph, program, chosen):
    space = f"/{program.partition('/')[2]}_{chosen}"
    argv = (str(graph.workspace / "lib" / program), f"__ns:={space}")
    node, probe = graph.run(*argv), graph.probe()
    probe.watch(f"{space}/careful", "std_msgs/String", ["data"])
    assert probe.newest(f"{space}/careful") == ["on by default"]
    assert probe.call(f"{space}/set_careful", "std_srvs/SetBool", {"data": chosen})[1]["success"]
    node.kill()
    probe.forget(f"{space}/careful")
    graph.run(*argv)
    assert probe.newest(f"{space}/careful") == ["on" if chosen else "off"]


def test_another_value_is_named(graph):
    node = str(graph.workspace / "lib/rto_node/rto_drive_link")
    ended = subprocess.run([node, "_careful:=maybe"], env=graph.environment, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1 and "careful must be true, false or auto, not 'maybe'" in ended.stderr
