"""The careful scan at the start, chosen by launch arguments or by nobody. Switching is tested with the gates."""

from __future__ import annotations

import subprocess

import pytest

pytestmark = pytest.mark.ros

LASER = "unavailable: The laser sees all around: the body need not sway."
CASES = {
    ("rto_node/rto_drive_link",): "on by default",
    ("rto_node/rto_drive_link", "_careful:=false"): "off",
    ("rto_node/rto_drive_link", "_laser:=true", "_careful:=true"): LASER,
    ("rto_safe_teleop/safe_omni_drive", "_laser:=true"): "off by default",
    ("rto_safe_teleop/safe_omni_drive", "_laser:=true", "_careful:=true"): "on",
}


def test_what_counts_until_somebody_switches(graph, until_true):
    probe = graph.probe()
    for number, (program, *parameters) in enumerate(CASES):
        graph.run(str(graph.workspace / "lib" / program), *parameters, f"__ns:=/r{number}")
        probe.watch(f"/r{number}/careful", "std_msgs/String", ["data"])
    for number, (case, state) in enumerate(CASES.items()):
        assert probe.newest(f"/r{number}/careful") == [state], case
    refused = probe.call("/r2/set_careful", "std_srvs/SetBool", {"data": True})
    assert refused == [True, {"success": False, "message": LASER.partition(": ")[2]}]


def test_another_value_is_named(graph):
    node = str(graph.workspace / "lib/rto_node/rto_drive_link")
    ended = subprocess.run([node, "_careful:=maybe"], env=graph.environment, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1 and "careful must be true, false or auto, not 'maybe'" in ended.stderr
