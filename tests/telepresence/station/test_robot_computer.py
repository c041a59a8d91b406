"""The checklist for a robot's own computer, on systems as a lab finds them."""

from __future__ import annotations

from telepresence.station import robot_computer

ROUTES = """Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask
enp0s25\t00000000\t0100A8C0\t0003\t0\t0\t0\t00000000
enp0s25\t0000A8C0\t00000000\t0001\t0\t0\t0\t00FFFFFF
"""


def test_a_default_gateway_is_found_and_its_lack_explained(tmp_path):
    route = tmp_path / "route"
    route.write_text(ROUTES)
    assert next(robot_computer.gateway(route))[:2] == (True, "default gateway: 192.168.0.1 on enp0s25")
    route.write_text("\n".join(line for line in ROUTES.splitlines() if "0003" not in line))
    fine, what, cure = next(robot_computer.gateway(route))
    assert (fine, what) == (False, "default gateway: none") and "ip route add default" in cure


def test_a_system_without_name_servers_is_told_how_to_get_one(tmp_path):
    resolver = tmp_path / "resolv.conf"
    for text in ("", "# nothing here\nsearch lab\n", None):
        if text is not None:
            resolver.write_text(text)
        else:
            resolver.unlink()
        findings = list(robot_computer.name_servers(resolver))
        assert len(findings) == 1 and not findings[0][0] and "nameserver" in findings[0][2]


def test_a_name_of_ones_own_is_looked_up(tmp_path, monkeypatch):
    resolver = tmp_path / "resolv.conf"
    resolver.write_text("nameserver 192.168.0.1\n")
    asked = []
    monkeypatch.setattr(robot_computer.socket, "getaddrinfo", lambda name, port: asked.append(name))
    assert [fine for fine, _, _ in robot_computer.name_servers(resolver)] == [True, True]
    assert list(robot_computer.name_servers(resolver, host="printer.lab"))[1][1] == "the name printer.lab is known"
    assert asked == ["example.org", "printer.lab"]


def test_packages_of_the_vendor_that_an_upgrade_would_break_are_named():
    status = "robotino-daemons install\nrobotino-api2 hold\nvim install\nlibrealsense2 install\n"
    fine, what, cure = next(robot_computer.held_packages(status))
    assert not fine and "1 of 3" in what and cure.endswith("apt-mark hold librealsense2 robotino-daemons")
    assert next(robot_computer.held_packages("robotino-api2 hold\n"))[0]
    assert list(robot_computer.held_packages("vim install\n")) == [], "no robot's computer"


def test_a_full_disk_and_a_wrong_clock_are_findings():
    assert not next(robot_computer.disk(10_000))[0] and next(robot_computer.disk(10 << 30))[0]
    assert not next(robot_computer.clock("no\n"))[0] and next(robot_computer.clock("yes\n"))[0]
