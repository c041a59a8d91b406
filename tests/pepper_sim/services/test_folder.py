"""The folder is its own index: one file, one service, one name; and each of them is served."""

import importlib
import re
from pathlib import Path

import pytest

from pepper_sim import services
from pepper_sim.naoqi.service import Service

FILES = sorted(path.stem for path in Path(services.__file__).parent.glob("[!_]*.py"))


def classes_of(file):
    module = importlib.import_module(f"pepper_sim.services.{file}")
    defined = [value for value in vars(module).values() if getattr(value, "__module__", "") == module.__name__]
    return [value for value in defined if isinstance(value, type) and issubclass(value, Service)]


def snake_case(name):
    return re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=^AL)(?=[A-Z])", "_", name).lower()


@pytest.mark.parametrize("file", FILES)
def test_a_file_defines_the_one_service_that_it_is_named_after(file):
    (service,) = classes_of(file)
    assert service.__name__ == service.name
    assert snake_case(service.name) == file


def test_every_file_is_served(session, simulation):
    names = {service.name for file in FILES for service in classes_of(file)}
    assert len(names) == len(FILES) > 40
    assert {service.name for service in simulation.server.catalogue.services} == names
    assert names <= {info["name"] for info in session.services()}


def test_a_service_that_needs_what_no_robot_has_is_refused(simulation):
    class ALLost(Service):
        name = "ALLost"

        def __init__(self, wings: bytes) -> None:
            raise AssertionError("must not be made")

    with pytest.raises(TypeError, match="ALLost needs <class 'bytes'>"):
        simulation.server.catalogue._make(ALLost)
