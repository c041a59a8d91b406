"""Every method of the maker's documentation does what it says, or refuses it: see `documented_calls`.

Those that take time are in test_documented_methods_that_take_time.py. `-k ALBattery` takes one service.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from documented_calls import BASES, DOCUMENTED, LONG, OWN, SERVICES, Caller, inherited, put_files

from pepper_sim import coverage
from pepper_sim.documentation import FOLDER, DocumentationError, read

LEAST = 95.0
"""Percent of what is documented for Pepper that the robot does."""


@pytest.fixture(scope="module")
def files(simulation) -> Iterator[None]:
    """What the arguments name is on the robot's disk."""
    put_files(simulation.server.catalogue.disk)
    yield
    packages = simulation.server.catalogue.packages
    if "documented" in [package.uuid for package in packages.packages]:
        packages.remove("documented")


@pytest.mark.parametrize("name", [name for name, (_, method) in OWN.items() if method.seconds < LONG])
def test_a_method(naoqi, files, name):
    service, method = OWN[name]
    Caller(naoqi, service).check(method)


@pytest.mark.parametrize("service", [name for name in SERVICES if inherited(name)])
def test_what_a_service_inherits(naoqi, files, service):
    caller = Caller(naoqi, service)
    for method in inherited(service):
        caller.check(method)


def test_the_page_is_up_to_date():
    assert coverage.main(["--check"]) == 0


def test_nearly_all_that_is_documented_for_pepper_works():
    assert coverage.percentage(DOCUMENTED) >= LEAST


def test_what_is_missing_is_listed(simulation):
    services = simulation.server.catalogue.services
    assert coverage.missing(DOCUMENTED, services) == []
    without = [service for service in services if service.name != "ALBattery"]
    assert coverage.missing(DOCUMENTED, without) == ["ALBattery.getBatteryCharge"]


METHOD = 'service = "S"\npages = ["p"]\n[[method]]\nname = "m"\n'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("service = ", "S.toml"),
        ('service = "T"\npages = ["p"]', "the service is called 'T'"),
        ('service = "S"', "'pages' is missing"),
        (METHOD, "m: 'signatures' is missing"),
        (METHOD + 'signatures = ["v()"]\nanswers = "does"', "m: unknown key 'answers'"),
        (METHOD + 'signatures = ["v"]', "'v' must be a return and parameters"),
        (METHOD + 'signatures = ["v()"]\nanswer = "cannot"', "m: what it cannot needs `why`"),
        (METHOD + 'signatures = ["v()"]\nreleases = ["2.9"]', "releases is one of 2.5, 2.8"),
        (METHOD + 'signatures = ["v(i)"]\nvalid = [1]', "valid must be a list of lists"),
        (METHOD + 'signatures = ["v()"]\nbefore = [["ALMotion"]]', "a call is a service, a method"),
        (METHOD + 'signatures = ["v()"]\n[[method]]\nname = "m"\nsignatures = ["v(i)"]', "'m' stands twice"),
    ],
)
def test_a_file_that_says_something_else_is_refused(tmp_path, text, says):
    file = tmp_path / "S.toml"
    file.write_text(text)
    with pytest.raises(DocumentationError) as caught:
        read(file)
    assert says in str(caught.value)


def test_every_file_is_about_a_service_or_what_services_inherit():
    unknown = [file.stem for file in FOLDER.glob("*.toml") if file.stem not in {**SERVICES, **BASES}]
    assert [name for name in unknown if any(method.answer != "cannot" for method in DOCUMENTED[name].methods)] == []
