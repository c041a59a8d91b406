"""The podman quadlet for a computer beside a robot: its keys are podman's and systemd's, its words the project's."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from pathlib import Path

from telepresence import ports
from telepresence.station import up
from telepresence.station.launch_settings import launch_arguments
from telepresence.station.unprivileged import SYSTEM_HOME

ROOT = Path(__file__).resolve().parents[3]
FILE = ROOT / "launch" / "telepresence.container"
KEYS = {
    "Image", "ContainerName", "Exec", "Environment", "PublishPort", "Volume", "ReadOnly", "DropCapability",
    "NoNewPrivileges", "PodmanArgs", "AddDevice", "Network",
}  # fmt: skip
"""Keys of [Container] in podman-systemd.unit(5) of podman 4.4, the first with quadlets; later ones know them, too."""


def section(name: str) -> list[tuple[str, str]]:
    """Return the keys and values of a section, in order."""
    text = re.search(rf"^\[{name}\]\n(.*?)(?=^\[|\Z)", FILE.read_text(), re.M | re.S)[1]
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return [tuple(line.split("=", 1)) for line in lines]


def test_podman_knows_every_key():
    assert re.findall(r"^\[(\w+)\]$", FILE.read_text(), re.M) == ["Unit", "Container", "Service", "Install"]
    assert {key for key, _ in section("Container")} <= KEYS


def test_it_brings_up_a_unit_with_settings_that_there_are():
    word, *words = shlex.split(dict(section("Container"))["Exec"])
    arguments = up.parse(["--unit", *words])
    assert word == "unit" and arguments.robot == "pepper"
    assert set(arguments.settings) <= launch_arguments("pepper") and arguments.settings["sim"] == "false"


def test_ports_and_volume_are_the_images():
    found = section("Container")
    udp = re.search(r"TELEPRESENCE_PAGE_UDP=(\S+)", (ROOT / "Containerfile").read_text())[1]
    page, tablet = (f"{port}:{port}" for port in (ports.PILOT_PAGE, ports.TABLET_PAGE))
    assert [value for key, value in found if key == "PublishPort"] == [page, f"{udp}:{udp}/udp", tablet]
    assert dict(found)["Volume"].partition(":")[2] == SYSTEM_HOME


def test_systemd_accepts_the_rest(tmp_path, monkeypatch):
    """The generator writes [Container] into one line of [Service], and leaves everything else as it is."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    path = tmp_path / "telepresence.service"
    service = re.sub(r"^\[Container\]\n.*?(?=^\[)", "", FILE.read_text(), flags=re.M | re.S)
    path.write_text(service.replace("[Service]", "[Service]\nType=notify\nExecStart=/bin/true"))
    if shutil.which("systemd-analyze") is None:
        assert "Restart=always" in service
        return
    result = subprocess.run(["systemd-analyze", "--user", "verify", str(path)], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
