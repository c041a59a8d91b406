"""The image's files agree with each other and with what they speak of; `tests/image` runs one, in minutes."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
from pathlib import Path

import pytest
import setuptools

from telepresence import ports
from telepresence.station.unprivileged import SYSTEM_HOME, SYSTEM_USER

ROOT = Path(__file__).resolve().parents[1]
FILE = (ROOT / "Containerfile").read_text()
STACK = (ROOT / "stack").read_text()
RUN, WINDOW, BUILD, TEST = (re.search(rf'^{name}="([^"]*)"', STACK, re.M)[1].split() for name in
                            ("PACKAGES", "WINDOW_PACKAGES", "BUILD_PACKAGES", "TEST_PACKAGES"))  # fmt: skip


def instructions(name: str) -> list[str]:
    """What follows each instruction of this name, a continued line as one."""
    return re.findall(rf"^{name} (.*)", FILE.replace("\\\n", " "), re.M)


def stack(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(ROOT / "stack"), *words], env={**os.environ, **environment}, capture_output=True, text=True, timeout=30
    )


def test_a_package_stands_in_one_list():
    assert len({*RUN, *WINDOW, *BUILD, *TEST}) == len([*RUN, *WINDOW, *BUILD, *TEST])


def test_what_an_image_runs_with_builds_nothing():
    assert not [name for name in [*RUN, *WINDOW] if name.endswith("-dev") or name in ("catkin", "g++", "make")]
    assert {"g++", "catkin"} <= {*BUILD}


def test_its_stages_call_the_layers_of_stack_and_install_nothing_themselves():
    layers = re.search(r"^layer\(\) \{.*?^\}", STACK, re.M | re.S)[0]
    run = " && ".join(instructions("RUN"))
    assert re.findall(r"stack layer (\w+)", run) == re.findall(r"^    (\w+)\)$", layers, re.M)
    assert not re.search(r"apt-get|pip|dpkg", FILE)


def test_its_user_home_and_port_are_the_projects():
    (line,) = [each for each in instructions("RUN") if "useradd" in each]
    assert f"--home-dir {SYSTEM_HOME} " in line and line.split("&&")[0].split()[-1] == SYSTEM_USER
    assert instructions("VOLUME") == [SYSTEM_HOME] and instructions("USER") == [SYSTEM_USER]
    assert f"HOME={SYSTEM_HOME} " in FILE
    assert instructions("EXPOSE") == [str(ports.PILOT_PAGE)]


def test_every_line_that_starts_it_publishes_its_ports():
    """TCP under its number, and for WebRTC the range that the image binds."""
    udp = re.search(r"TELEPRESENCE_PAGE_UDP=(\S+)", FILE)[1]
    wanted = (
        f"-p 127.0.0.1:{ports.PILOT_PAGE}:{ports.PILOT_PAGE} -p 127.0.0.1:{udp}:{udp}/udp -v telepresence:{SYSTEM_HOME}"
    )
    for page, count in (("README.md", 1), ("docs/container.md", 2), ("stack", 1)):
        assert (ROOT / page).read_text().count(wanted) == count, page


def test_it_can_ask_whether_it_is_healthy():
    (line,) = instructions("HEALTHCHECK")
    python, safe, option, module = json.loads(line.partition(" CMD ")[2])
    assert (python, safe, option) == ("python3", "-P", "-m") and importlib.util.find_spec(module)


def test_all_that_setup_py_installs_is_sent_to_the_builder_and_no_test(monkeypatch: pytest.MonkeyPatch):
    lines = (ROOT / ".dockerignore").read_text().splitlines()
    sent = {line[1:] for line in lines if line.startswith("!")}
    arguments: dict = {}
    monkeypatch.setattr(setuptools, "setup", arguments.update)
    monkeypatch.chdir(ROOT)
    exec(compile((ROOT / "setup.py").read_text(), "setup.py", "exec"), {})
    assert {name.partition(".")[0] for name in arguments["packages"]} <= sent
    assert {"stack", "env.sh", "requirements", "launch", "catkin_ws/src"} <= sent
    assert "*" in lines and "tests" not in sent and all((ROOT / name).exists() for name in sent)


def test_without_a_tool_it_says_what_to_install():
    answer = stack("image", CONTAINER_TOOL="no-such-tool")
    assert answer.returncode == 1 and "install one" in answer.stderr


@pytest.mark.parametrize("words", [("--arch", "mips"), ("--arch",), ("--tag", "x")], ids=" ".join)
def test_it_refuses_what_it_does_not_know(words: tuple[str, ...]):
    answer = stack("image", *words)
    assert answer.returncode == 1 and "stack: " in answer.stderr


def test_help_names_the_processors():
    assert "amd64|arm64" in stack("image", "--help").stdout


def test_it_builds_for_the_processor_that_is_asked_for(tmp_path: Path):
    """The engine is called with its own words; this one only writes them down."""
    for name in ("podman", "docker"):
        tool = tmp_path / name
        tool.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" >{tmp_path}/{name}.words\n')
        tool.chmod(0o755)
        assert (
            stack(
                "image", "--arch", "arm64", CONTAINER_TOOL=str(tool), CONTAINER_BUILD_OPTIONS="--pull=never --layers"
            ).returncode
            == 0
        )
        words = (tmp_path / f"{name}.words").read_text().split()
        assert words[0] == "build" and words[words.index("--platform") + 1] == "linux/arm64"
        assert "--layers" in words and words[-1] == str(ROOT)
        assert ("--format" in words) == (name == "podman")  # a healthcheck is part of Docker's format alone
