"""Packages as files: what is taken and what is refused."""

import zipfile

import pytest

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.installed_packages import BUILT_IN_BEHAVIORS, InstalledPackages

MANIFEST = """<package uuid="{uuid}" version="1.2">
 <contents><behaviorContent path="dance/tango"/></contents>
 <services><service name="main" execStart="/usr/bin/python main.py"/></services>
</package>"""


@pytest.fixture
def disk():
    disk = RobotDisk()
    yield disk
    disk.close()


def package(path, files):
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


def test_behaviours_and_services_come_and_go_with_their_package(disk, tmp_path):
    packages, removals = InstalledPackages(disk), []
    packages.on_removed(lambda: removals.append(True))
    file = package(tmp_path / "a.pkg", {"manifest.xml": MANIFEST.format(uuid="app"), "main.py": "print(1)"})
    packages.install(file)
    assert packages.behaviors == [*BUILT_IN_BEHAVIORS, "app/dance/tango"]
    assert packages.service("app.main") is packages.service("main") is not None
    assert (packages.service("main").folder / "main.py").read_text() == "print(1)"
    packages.install(file)
    assert len(packages.packages) == 1 and len(removals) == 1, "it replaces the older one"
    packages.remove("app")
    assert packages.service("app.main") is None and packages.behaviors == list(BUILT_IN_BEHAVIORS)


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        ({"main.py": ""}, "manifest.xml"),
        ({"manifest.xml": "<package"}, "no package"),
        ({"manifest.xml": "<package/>"}, "uuid ''"),
        ({"manifest.xml": MANIFEST.format(uuid="../../etc")}, "uuid"),
        ({"manifest.xml": MANIFEST.format(uuid="app"), "../../evil": ""}, "outside its folder"),
        ({"manifest.xml": MANIFEST.format(uuid="app"), "/evil": ""}, "outside its folder"),
    ],
)
def test_what_is_no_package_is_refused(disk, tmp_path, files, reason):
    with pytest.raises(ValueError, match=reason):
        InstalledPackages(disk).install(package(tmp_path / "a.pkg", files))


def test_a_file_that_is_not_there_or_no_zip_is_refused(disk, tmp_path):
    (tmp_path / "text.pkg").write_text("no zip")
    for name in ("text.pkg", "nothing.pkg"):
        with pytest.raises(ValueError, match="is no package"):
            InstalledPackages(disk).install(tmp_path / name)
