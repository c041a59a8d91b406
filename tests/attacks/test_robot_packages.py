"""Another user of the computer on which a simulated Pepper runs, or somebody on its network, and the programs of
packages: what the robot runs, it runs as the user who has started it."""

from __future__ import annotations

import ctypes
import os
import socket
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pepper_sim.disk import APPS
from pepper_sim.simulation import Simulation
from telepresence.naoqi import Session

NOBODY = 65534
MANIFEST = """<package uuid="theirs" version="1">
 <contents><behaviorContent path="script"/></contents>
 <services><service name="main" execStart="touch {proof}"/></services>
</package>"""
SCRIPT = """<?xml version="1.0" encoding="UTF-8"?>
<ChoregrapheProject xmlns="http://www.aldebaran-robotics.com/schema/choregraphe/project.xsd" xar_version="3">
 <Box name="root" id="-1"><script language="4"><content><![CDATA[
class MyClass(GeneratedClass):
    def onLoad(self):
        open({proof!r}, "w").close()
]]></content></script></Box></ChoregrapheProject>"""


@pytest.fixture(scope="module")
def robot() -> Iterator[Simulation]:
    with Simulation(scene="empty", port=0) as running:
        yield running


@pytest.fixture
def clients(robot: Simulation) -> Iterator[list[Session]]:
    opened: list[Session] = []
    yield opened
    for session in opened:
        session.close()


@pytest.fixture
def stranger(robot: Simulation, clients: list[Session], monkeypatch: pytest.MonkeyPatch) -> Session:
    """A client whose socket is another user's, as Linux notes it when the socket is made."""
    connect, libc = socket.create_connection, ctypes.CDLL(None)

    def as_nobody(*arguments: Any, **more: Any) -> socket.socket:
        libc.setfsuid(NOBODY)
        try:
            return connect(*arguments, **more)
        finally:
            libc.setfsuid(os.geteuid())

    with monkeypatch.context() as patched:
        patched.setattr("telepresence.naoqi.dial.socket.create_connection", as_nobody)
        return client(robot, clients)


def client(robot: Simulation, clients: list[Session]) -> Session:
    session = Session()
    clients.append(session)
    session.connect(robot.url)
    return session


@pytest.fixture
def package(robot: Simulation, tmp_path: Path) -> Path:
    """A package on the robot's disk; the file that its programs would make."""
    proof = tmp_path / "proof"
    with zipfile.ZipFile(robot.server.catalogue.disk.path("/home/nao/theirs.pkg"), "w") as archive:
        archive.writestr("manifest.xml", MANIFEST.format(proof=proof))
        archive.writestr("script/behavior.xar", SCRIPT.format(proof=str(proof)))
    return proof


def test_what_a_stranger_installs_does_not_run(stranger: Session, package: Path) -> None:
    assert stranger.service("PackageManager").install("/home/nao/theirs.pkg") is True
    for service, method, name in (
        ("ALServiceManager", "startService", "theirs.main"),
        ("ALServiceManager", "start", "theirs.main"),
        ("ALBehaviorManager", "runBehavior", "theirs/script"),
        ("ALBehaviorManager", "startBehavior", "theirs/script"),
    ):
        with pytest.raises(RuntimeError, match="--package"):
            getattr(stranger.service(service), method)(name)
    assert not package.exists()


def test_nor_does_it_for_the_user(robot: Simulation, clients: list[Session], stranger: Session, package: Path) -> None:
    stranger.service("PackageManager").install("/home/nao/theirs.pkg")
    with pytest.raises(RuntimeError, match="--package"):
        client(robot, clients).service("ALServiceManager").startService("theirs.main")
    assert not package.exists()


def test_what_the_user_installs_runs(robot: Simulation, clients: list[Session], package: Path, wait_until) -> None:
    own = client(robot, clients)
    own.service("PackageManager").install("/home/nao/theirs.pkg")
    assert own.service("ALServiceManager").startService("theirs.main") is True
    wait_until(package.exists, "its program runs")


@pytest.mark.parametrize("way", ["plainly", "by a relative name"])
def test_no_service_writes_among_the_packages(stranger: Session, robot: Simulation, way: str) -> None:
    target = f"{APPS}/theirs/main.py"
    name = target if way == "plainly" else target.removeprefix("/home/nao/")
    dialog = stranger.service("ALDialog")
    topic = dialog.loadTopicContent("topic: ~evil()\nlanguage: enu\nu:(import os) yes\n")
    for service, method, arguments in (
        ("ALDialog", "generateSentences", (name, topic, "English")),
        ("ALTextToSpeech", "sayToFile", ("import os", name)),
        ("ALAudioRecorder", "startMicrophonesRecording", (name, "wav", 16000, [0, 0, 1, 0])),
        ("ALVideoRecorder", "startRecording", (name.rpartition("/")[0], "main", True)),
        ("ALPhotoCapture", "takePicture", (name.rpartition("/")[0], "main", True)),
    ):
        with pytest.raises(RuntimeError, match="among installed packages"):
            getattr(stranger.service(service), method)(*arguments)
    dialog.unloadTopic(topic)
    assert not [*robot.server.catalogue.disk.path(APPS).rglob("main.*")]
