"""The animations that a Pepper carries: their paths, their tags, and their curves, which are our own."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from pepper_sim.animations.generator import Curves, draw

_FILE = Path(__file__).with_name("library.toml")


def paths() -> tuple[str, ...]:
    """List the paths of all animations, "animations/Stand/Gestures/Hey_1"."""
    return tuple(_folders())


def has(path: str) -> bool:
    """Whether there is an animation of this path."""
    return path in _folders()


@functools.lru_cache(maxsize=256)
def curves(path: str) -> Curves:
    """Return the curves of an animation: joint -> ((seconds from the start, angle [rad]), ...).

    Raises:
        KeyError: There is no such animation.
    """
    return draw(_folders()[path], tags_of(path))


@functools.cache
def tags() -> Mapping[str, tuple[str, ...]]:
    """Return tag -> paths of the animations that carry it."""
    found: dict[str, dict[str, None]] = {}
    data = _data()
    for animations, names in data["tags"].items():
        for tag in names.split(";"):
            found.setdefault(tag.strip(), {}).update(dict.fromkeys(_find(animations)))
    for tag, animations in data["body_language"].items():
        found.setdefault(tag, {}).update(dict.fromkeys(_find(animations)))
    return MappingProxyType({tag: tuple(animations) for tag, animations in found.items()})


def tags_of(path: str) -> tuple[str, ...]:
    """Return the tags of an animation."""
    return _tags_of().get(path, ())


@functools.cache
def _tags_of() -> Mapping[str, tuple[str, ...]]:
    found: dict[str, list[str]] = {}
    for tag, animations in tags().items():
        for path in animations:
            found.setdefault(path, []).append(tag)
    return MappingProxyType({path: tuple(names) for path, names in found.items()})


@functools.cache
def _data() -> dict:
    return tomllib.loads(_FILE.read_text(encoding="utf-8"))


@functools.cache
def _folders() -> Mapping[str, str]:
    """Return path -> name of every animation."""
    return MappingProxyType(
        {
            f"{folder}/{name}": name
            for folder, names in _data()["folders"].items()
            for family, numbers in _families(names)
            for name in _names(family, numbers)
        }
    )


def _find(animations: str) -> Iterator[str]:
    """Return the paths of animations that are named without their folder, or with its last part only.

    Raises:
        ValueError: There is no animation of one of these names.
    """
    for family, numbers in _families(animations):
        folder, _, family = family.rpartition("/")
        for name in _names(family, numbers):
            ending = f"{folder}/{name}" if folder else name
            matching = _paths_by_ending().get(ending)
            if not matching:
                raise ValueError(f"library.toml: no folder has the animation {ending!r}")
            yield from matching


@functools.cache
def _paths_by_ending() -> Mapping[str, list[str]]:
    """Return the last parts of a path, "Hey_1" or "Gestures/Hey_1" -> every path that ends so."""
    found: dict[str, list[str]] = {}
    for path in _folders():
        parts = path.split("/")
        for start in range(1, len(parts)):
            found.setdefault("/".join(parts[start:]), []).append(path)
    return MappingProxyType(found)


def _families(text: str) -> Iterator[tuple[str, list[str]]]:
    """Parse "Hey 1-7; Sneeze" to ("Hey", ["1", ... "7"]), ("Sneeze", [])."""
    for part in text.split(";"):
        family, _, numbers = " ".join(part.split()).partition(" ")
        yield family, list(_numbers(numbers))


def _numbers(text: str) -> Iterable[str]:
    for part in filter(None, (item.strip() for item in text.split(","))):
        first, _, last = part.partition("-")
        for number in range(int(first), int(last or first) + 1):
            yield str(number).zfill(len(first))


def _names(family: str, numbers: list[str]) -> list[str]:
    return [f"{family}_{number}" for number in numbers] or [family]
