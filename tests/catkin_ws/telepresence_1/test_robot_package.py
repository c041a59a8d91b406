"""robotvideo.pkg: built by the script, installed on a simulated robot, its service started and stopped there."""

from __future__ import annotations

import runpy
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from python2_syntax import assert_python_2

from pepper_sim.simulation import Simulation
from telepresence.robot_side.naoqi_values import NaoqiError

import qi  # isort: skip  -- after pepper_sim, which sets libqi's log level

ROBOT = Path(__file__).resolve().parents[3] / "catkin_ws" / "src" / "telepresence_1" / "robot"
ACTIVITY, SERVICE = "robotvideo/behaviour", "robotvideo.main"


def build(folder: Path, *arguments: str) -> Path:
    file = folder / "robotvideo.pkg"
    command = [sys.executable, str(ROBOT / "make_package.py"), "--output", str(file), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "qicli call PackageManager.install /home/nao/robotvideo.pkg" in done.stdout
    return file


def test_the_package_holds_what_its_manifest_names(tmp_path: Path) -> None:
    file = build(tmp_path, "--url", "http://10.0.0.10:10002/")
    data = file.read_bytes()
    with zipfile.ZipFile(file) as package:
        names = set(package.namelist())
        root = ElementTree.fromstring(package.read("manifest.xml"))
        assert package.read("page_url") == b"http://10.0.0.10:10002/\n"
        project = ElementTree.fromstring(package.read("robotvideo.pml"))
        behaviour = ElementTree.fromstring(package.read("behaviour/behavior.xar"))
        assert package.getinfo("scripts/robotvideo.py").external_attr >> 16 & 0o111, "it can be run"
    assert root.tag == "package" and root.get("uuid") == project.get("name") == "robotvideo" and root.get("version")
    assert [content.get("path") for content in root.iterfind("contents/behaviorContent")] == ["behaviour"]
    assert root.findtext("contents/behaviorContent/nature") == "interactive", "only such a one keeps the focus"
    (service,) = root.iterfind("services/service")
    assert service.get("name") == "main" and service.get("autorun") == "false"
    assert service.get("execStart").split() == ["/usr/bin/python", "scripts/robotvideo.py"]
    named = {element.get("src") for element in project.iter("File")} | {"scripts/robotvideo.py"}
    named |= {element.get("path") for element in root.iterfind("executableFiles/file")}
    named |= {"scripts/telepresence/__init__.py", "scripts/telepresence/robot_side/naoqi_client.py"}
    assert named | {"manifest.xml", "robotvideo.pml", "behaviour/behavior.xar"} <= names
    script = next(element.text for element in behaviour.iter() if "startService" in (element.text or ""))
    compile(script, "behavior.xar", "exec")
    assert f'NAME = "{SERVICE}"' in script
    assert build(tmp_path, "--url", "http://10.0.0.10:10002/").read_bytes() == data, "the same every time"


def test_the_service_keeps_to_python_2(tmp_path: Path) -> None:
    with zipfile.ZipFile(build(tmp_path)) as package:
        package.extractall(tmp_path)
    programs = sorted((tmp_path / "scripts").rglob("*.py"))
    assert tmp_path / "scripts" / "robotvideo.py" in programs
    for program in programs:
        assert_python_2(program)


def test_what_naoqi_refuses_is_printed_with_its_reason(capsys: pytest.CaptureFixture) -> None:
    def refuse() -> None:
        raise NaoqiError("\tALAutonomousLife::switchFocus\n\tActivity robotvideo/behaviour not found")

    module = runpy.run_path(str(ROBOT / "robotvideo" / "scripts" / "robotvideo.py"))
    module["RobotVideo"](SimpleNamespace(service=lambda _: None), "")._attempt("focus", refuse)
    said = "focus: ALAutonomousLife::switchFocus: Activity robotvideo/behaviour not found; trying again\n"
    assert capsys.readouterr().out == said


@pytest.fixture
def robot(tmp_path: Path, open_page: Callable, jpeg: Callable) -> Iterator[tuple[Simulation, qi.Session]]:
    """A robot with the package, built for a page that is served, and a client of it."""
    page = open_page()
    page.image.put(jpeg((0, 0, 200)))
    package = build(tmp_path, "--url", page.server.url)
    client = qi.Session()
    with Simulation(scene="empty", port=0, packages=[str(package)]) as simulation:
        client.connect(simulation.url)
        yield simulation, client
        client.close()


def test_it_is_started_and_stopped_on_the_robot(robot: tuple[Simulation, qi.Session], wait_until: Callable) -> None:
    simulation, client = robot
    tablet, manager, life = simulation.tablet, client.service("ALServiceManager"), client.service("ALAutonomousLife")
    packages = client.service("PackageManager")
    assert packages.hasPackage("robotvideo") and ACTIVITY in client.service("ALBehaviorManager").getInstalledBehaviors()
    stopped: list[tuple[str, int]] = []
    manager.serviceStopped.connect(lambda name, reason: stopped.append((name, reason)))
    assert manager.isServiceRunning(SERVICE) is False
    assert manager.startService(SERVICE) is True and manager.isServiceRunning(SERVICE) is True
    wait_until(lambda: tablet.visible, "the page is there without autonomous life")
    life.setState("solitary")
    wait_until(lambda: tablet.visible and life.focusedActivity() == ACTIVITY, "page and focus")
    client.service("ALTabletService").hideWebview()
    wait_until(lambda: tablet.visible, "the page comes back")
    assert manager.stopService(SERVICE) is True and manager.isServiceRunning(SERVICE) is False
    assert not tablet.visible and life.focusedActivity() == "", "all is given back when the call returns"
    assert "/blank?" in tablet.url, "the hidden page is not loaded any more"
    wait_until(lambda: stopped == [(SERVICE, 0)], "the stop was reported")
    manager.start(SERVICE)
    wait_until(lambda: life.focusedActivity() == ACTIVITY, "it runs again")
    packages.removePkg("robotvideo")
    wait_until(lambda: len(stopped) == 2, "its program ends with it")
    assert packages.hasPackage("robotvideo") is False and manager.startService(SERVICE) is False
