"""What the maker's documentation lists: services, their methods, and what the simulated robot makes of them.

`documented/<Service>.toml` holds one service:

    service = "ALNavigation"
    pages = ["naoqi/motion/alnavigation-api.html"]   # of the NAOqi 2.8 documentation

    [[method]]
    name = "explore"
    signatures = ["i(f)"]          # documented return and parameters, in qi's letters; several for overloads
    releases = ["2.5", "2.8"]      # whose documentation lists it; this is the default
    robot = "pepper"               # default; "nao": documented for the two-legged robot only, which is not counted
    answer = "does"                # default; "refuses" (as Pepper does) or "cannot" (not here); both need `why`
    why = "..."                    # one sentence
    before = [["ALMotion", "wakeUp"]]   # calls made first
    valid = [[2.0]]                # argument lists that must work, or must be refused with `error` in the text; [[]] is
                                   # the default where an overload has no parameters
    invalid = [[-1.0]]             # that must be an error; wrong kinds and numbers of arguments follow by themselves
    after = [["ALNavigation", "stopExploration"]]   # calls made at the end
    error = "..."                  # part of the refusal's text
    seconds = 0.0                  # how long a valid call may take, documented or computed
    result = "[s]"                 # what an answer declared as "m" holds

As an argument, "$0" is what the first call of `before` answered, "$1" the second's. ALModule.toml and ALExtractor.toml
hold what services inherit; there, calls to "ALModule" and "ALExtractor" go to the service that inherits.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any

from telepresence.naoqi.signature import WireError, parse, split

FOLDER = Path(__file__).parent / "documented"
RELEASES = ("2.5", "2.8")
ANSWERS = ("does", "refuses", "cannot")
ROBOTS = ("pepper", "nao")
INHERITED = ("ALModule", "ALExtractor", "ALVisionExtractor")
"""What services inherit from; no services themselves."""
_FOR_NAO = "It is for the two-legged robot."


@dataclass(frozen=True)
class Call:
    """A call of a method, made before or after others."""

    service: str
    method: str
    arguments: tuple[Any, ...]


@dataclass(frozen=True)
class Method:
    """A documented method; the attributes are the keys of the file, see above."""

    name: str
    signatures: tuple[str, ...]
    releases: tuple[str, ...] = RELEASES
    robot: str = "pepper"
    answer: str = ""
    why: str = ""
    before: tuple[Call, ...] = ()
    valid: tuple[tuple[Any, ...], ...] = ()
    invalid: tuple[tuple[Any, ...], ...] = ()
    after: tuple[Call, ...] = ()
    error: str = ""
    seconds: float = 0.0
    result: str = ""

    @property
    def counted(self) -> bool:
        """Whether it is documented for Pepper."""
        return self.robot == "pepper"

    def parameters(self) -> list[tuple[str, ...]]:
        """Return the kinds of the parameters, one tuple per overload."""
        return [split(split(signature)[1][1:-1]) for signature in self.signatures]


@dataclass(frozen=True)
class ServiceDocumentation:
    """A documented service, or what services inherit."""

    service: str
    pages: tuple[str, ...]
    methods: tuple[Method, ...]


class DocumentationError(ValueError):
    """A file does not say what it must; the text names the file, the method and the key."""


def read_all(folder: Path = FOLDER) -> dict[str, ServiceDocumentation]:
    """Return the documentation by service, sorted by name.

    Raises: DocumentationError: As of `read`.
    """
    return {file.stem: read(file) for file in sorted(folder.glob("*.toml"))}


def read(file: Path) -> ServiceDocumentation:
    """Return what one file says.

    Raises: DocumentationError: It is no TOML, a key is unknown or missing, or a key cannot have its value.
    """
    try:
        content = tomllib.loads(file.read_text())
    except tomllib.TOMLDecodeError as error:
        raise DocumentationError(f"{file.name}: {error}") from None
    _check_keys(content, {"service", "pages", "method"}, {"service", "pages"}, file.name)
    if content["service"] != file.stem:
        raise DocumentationError(f"{file.name}: the service is called {content['service']!r}")
    pages = _texts(content["pages"], f"{file.name}: pages")
    methods = tuple(_method(table, file.name) for table in content.get("method", []))
    names = [method.name for method in methods]
    if twice := {name for name in names if names.count(name) > 1}:
        raise DocumentationError(f"{file.name}: {min(twice)!r} stands twice; its overloads belong in `signatures`")
    return ServiceDocumentation(content["service"], pages, methods)


def _method(table: Mapping[str, Any], file: str) -> Method:
    place = f"{file}: {table.get('name', 'a method')}"
    required = {field.name for field in fields(Method) if field.default is MISSING}
    _check_keys(table, {field.name for field in fields(Method)}, required, place)
    values: dict[str, Any] = dict(table)
    for key in ("signatures", "releases"):
        if key in values:
            values[key] = _texts(values[key], f"{place}: {key}")
    for key in ("valid", "invalid"):
        if key in values:
            values[key] = tuple(tuple(arguments) for arguments in _lists(values[key], f"{place}: {key}"))
    for key in ("before", "after"):
        values[key] = tuple(_calls(values.get(key, []), f"{place}: {key}"))
    values["robot"] = _one_of(values.get("robot", "pepper"), ROBOTS, f"{place}: robot")
    for_nao = values["robot"] == "nao"
    values["answer"] = _one_of(values.get("answer", "refuses" if for_nao else "does"), ANSWERS, f"{place}: answer")
    if values["answer"] != "does" and not values.setdefault("why", _FOR_NAO if for_nao else ""):
        raise DocumentationError(f"{place}: what it {values['answer']} needs `why`")
    for release in values.get("releases", ()):
        _one_of(release, RELEASES, f"{place}: releases")
    for signature in values["signatures"]:
        _check_signature(signature, place)
    if not values.get("valid") and any(split(signature)[1] == "()" for signature in values["signatures"]):
        values["valid"] = ((),)
    if values.get("result"):
        _check_type(values["result"], place)
    return Method(**values)


def _check_keys(table: Mapping[str, Any], known: set[str], required: set[str], place: str) -> None:
    if unknown := set(table) - known:
        raise DocumentationError(f"{place}: unknown key {min(unknown)!r}; known: {', '.join(sorted(known))}")
    if missing := required - set(table):
        raise DocumentationError(f"{place}: {min(missing)!r} is missing")


def _check_signature(signature: str, place: str) -> None:
    try:
        parts = split(signature)
    except WireError as error:
        raise DocumentationError(f"{place}: {error}") from None
    if len(parts) != 2 or not parts[1].startswith("("):
        raise DocumentationError(f"{place}: {signature!r} must be a return and parameters, such as 'b(si)'")


def _check_type(signature: str, place: str) -> None:
    try:
        parse(signature)
    except WireError as error:
        raise DocumentationError(f"{place}: {error}") from None


def _texts(value: Any, place: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not value or not all(isinstance(text, str) for text in value):
        raise DocumentationError(f"{place} must be a list of strings")
    return tuple(value)


def _lists(value: Any, place: str) -> list[list]:
    if not isinstance(value, list) or not all(isinstance(item, list) for item in value):
        raise DocumentationError(f"{place} must be a list of lists")
    return value


def _calls(value: Any, place: str) -> Iterator[Call]:
    for words in _lists(value, place):
        if len(words) < 2 or not all(isinstance(word, str) for word in words[:2]):
            raise DocumentationError(f"{place}: a call is a service, a method and its arguments")
        yield Call(words[0], words[1], tuple(words[2:]))


def _one_of(value: Any, choices: tuple[str, ...], place: str) -> str:
    if value not in choices:
        raise DocumentationError(f"{place} is one of {', '.join(choices)}")
    return value
