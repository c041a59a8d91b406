"""Calls NAOqi's documented methods as `pepper_sim/documented/` says, and fails where an answer is another one.

Declared with the documented types, answered in time with a value of its type, and what is wrong is refused in one short
line; what services inherit is called on each of them.
"""

from __future__ import annotations

import functools
import math
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import pytest

from pepper_sim.disk import RobotDisk
from pepper_sim.documentation import Call, Method, read_all
from pepper_sim.naoqi.catalogue import service_classes
from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import Module, Service
from pepper_sim.naoqi.vision_extractor import VisionExtractor
from telepresence.naoqi.signature import convertibility, parse, split

DOCUMENTED = read_all()
PATIENCE = 5.0
"""Seconds after its documented time in which a call must be answered."""
BASES = {"ALModule": Module, "ALExtractor": Extractor, "ALVisionExtractor": VisionExtractor}
SERVICES = {service.name: service for service in service_classes()}
OWN = {
    f"{service}.{method.name}": (service, method)
    for service, documentation in DOCUMENTED.items()
    if service not in BASES
    for method in documentation.methods
}
LONG = 1.0
"""Seconds; methods that may take as long are called side by side, on robots of their own."""
FILES = Path(__file__).resolve().parents[1] / "pepper_sim" / "documented_files"
"""Files that the arguments name: what is here is on the robot's disk, and a package, /home/nao/documented.pkg."""
MANIFEST = """<package uuid="documented" version="1.0.0"><contents><behaviorContent path="behavior_1"/></contents>
<services><service name="main" execStart="/usr/bin/python main.py"/></services></package>"""
_DECLARED: WeakKeyDictionary[Service, dict[str, set[str]]] = WeakKeyDictionary()
WRONG = (("s", "no number"), ("i", 7), ("[m]", ["a list"]))
"""Kind and value of what is tried where a parameter is of another kind."""


def put_files(disk: RobotDisk) -> None:
    """Put onto a robot's disk what the arguments name."""
    if FILES.is_dir():
        shutil.copytree(FILES, disk.root, dirs_exist_ok=True)
    with zipfile.ZipFile(disk.path("/home/nao/documented.pkg"), "w") as package:
        package.writestr("manifest.xml", MANIFEST)
        package.writestr("main.py", "import time\n\ntime.sleep(3600)\n")
        package.writestr("icon.png", b"\x89PNG")


def inherited(service: str) -> list[Method]:
    """What the service inherits and its own page does not list."""
    own = {method.name for method in DOCUMENTED[service].methods} if service in DOCUMENTED else set()
    return [
        method
        for base, kind in BASES.items()
        if issubclass(SERVICES[service], kind)
        for method in DOCUMENTED[base].methods
        if method.name not in own
    ]


class Caller:
    """Calls the methods of one service, and fails where an answer is not as documented."""

    def __init__(self, naoqi: Any, service: str) -> None:
        self._service = service
        self._service_of = functools.cache(naoqi.session.service)
        offered = {offered.name: offered for offered in naoqi.simulation.server.catalogue.services}
        self._declared = _declared(offered[service]) if service in offered else {}

    def check(self, method: Method) -> None:
        """Call the method as its documentation says."""
        declared = self._declared.get(method.name, set())
        if not declared and (method.answer == "cannot" or not method.counted):
            return
        documented = {"".join(parse(part).text for part in split(signature)) for signature in method.signatures}
        place = f"{self._service}.{method.name}"
        assert documented <= declared, f"{place} is declared {declared or 'nowhere'}, documented {documented}"
        if method.answer == "does":
            assert method.valid, f"{place}: `valid` has no arguments to call it with"
        answers = [self._made(call, ()) for call in method.before]
        try:
            for arguments in method.valid:
                value, error = self._outcome(self._service, method.name, _filled(arguments, answers), method.seconds)
                if method.answer == "does":
                    assert not error, f"{place}{arguments}: {error}"
                    self._check_type(method, arguments, value)
                else:
                    self._check_refusal(place, arguments, error)
                    assert method.error in error, f"{place}{arguments}: {error}"
            for arguments in method.invalid:
                self._check_refusal(
                    place, arguments, self._outcome(self._service, method.name, _filled(arguments, answers))[1]
                )
            for arguments in self._wrong(method, declared, answers):
                _, error = self._outcome(self._service, method.name, arguments)
                assert error and "Traceback" not in error, f"{place}{arguments}: {error or 'is no error'}"
        finally:
            for call in method.after:
                self._made(call, answers)

    def _made(self, call: Call, answers: Any) -> Any:
        service = self._service if call.service in BASES else call.service
        value, error = self._outcome(service, call.method, _filled(call.arguments, answers), 60.0)
        assert not error, f"{service}.{call.method}{call.arguments}: {error}"
        return value

    def _outcome(self, service: str, method: str, arguments: Any, seconds: float = 0.0) -> tuple[Any, str]:
        """What a call answers, and the text of its error."""
        try:
            future = getattr(self._service_of(service), method)(*arguments, _async=True)
            future.wait(round(1000 * (seconds + PATIENCE)))
            if not future.isFinished():
                future.cancel()
                pytest.fail(f"{service}.{method}{tuple(arguments)} is unanswered after {seconds + PATIENCE} s")
            return future.value(), ""
        except (RuntimeError, TypeError) as error:  # TypeError: no client can send such a value
            return None, str(error) or "an error without a text"

    def _check_refusal(self, place: str, arguments: Any, error: str) -> None:
        assert error, f"{place}{tuple(arguments)} is no error"
        assert place.replace(".", "::") in error, f"{place}{tuple(arguments)}: {error}"
        assert len(error) < 400 and error.count("\n") <= 1 and "Traceback" not in error, error

    def _check_type(self, method: Method, arguments: Any, value: Any) -> None:
        returned = {split(signature)[0] for signature in method.signatures}
        if method.result:
            returned = {method.result if kind == "m" else kind for kind in returned}
        place = f"{self._service}.{method.name}{arguments}"
        assert any(_fits(parse(kind), value) for kind in returned), f"{place} answered {value!r:.200}, not {returned}"

    @staticmethod
    def _wrong(method: Method, declared: set[str], answers: list) -> Iterator[tuple]:
        """Arguments of a wrong number, of a wrong kind, and NaN."""
        overloads = [split(split(signature)[1][1:-1]) for signature in declared]
        counts = {len(kinds) for kinds in overloads}
        for arguments in method.valid[:1]:
            right = _filled(arguments, answers)
            yield (*right, *[0] * (max(counts) + 1 - len(right)))
            if min(counts) > 0:
                yield right[: min(counts) - 1]
        for arguments in method.valid:
            right = _filled(arguments, answers)
            alike = [kinds for kinds in overloads if len(kinds) == len(right)]
            for place in range(len(right)):
                wanted = [kinds[place] for kinds in alike]
                for kind, value in WRONG:
                    if not any(convertibility(kind, want) for want in wanted):
                        yield (*right[:place], value, *right[place + 1 :])
                        break
                if wanted and all(want in ("f", "d") for want in wanted):
                    yield (*right[:place], math.nan, *right[place + 1 :])


def _declared(service: Service) -> dict[str, set[str]]:
    """Signatures by method; looked up once for all tests of a service."""
    if service not in _DECLARED:
        found: dict[str, set[str]] = {}
        for binding in service.bindings():
            found.setdefault(binding.name, set()).add(parse(binding.returns).text + parse(binding.parameters).text)
        _DECLARED[service] = found
    return _DECLARED[service]


def _filled(arguments: Any, answers: Any) -> tuple:
    """Put what earlier calls answered in the place of "$0", "$1", ..."""
    places = {f"${number}": answer for number, answer in enumerate(answers)}
    return tuple(places.get(word, word) if isinstance(word, str) else word for word in arguments)


def _fits(kind: Any, value: Any) -> bool:
    """Whether a client's value is one of this type."""
    octets = bytes | bytearray
    simple = {"v": type(None), "_": type(None), "b": bool, "f": float, "d": float, "s": str | octets, "r": octets}
    if kind.code in "mX":
        return True
    if kind.code in simple:
        return isinstance(value, simple[kind.code])
    if kind.code in "cCwWiIlL":
        return isinstance(value, int) and not isinstance(value, bool)
    if kind.code == "[":
        return isinstance(value, list | tuple) and all(_fits(kind.children[0], item) for item in value)
    if kind.code == "{":
        key, held = kind.children
        return isinstance(value, dict) and all(_fits(key, name) and _fits(held, value[name]) for name in value)
    if kind.code == "(":
        value = list(value.values()) if isinstance(value, dict) else value  # a structure with names
        return len(value) == len(kind.children) and all(map(_fits, kind.children, value))
    return value is not None  # an object
