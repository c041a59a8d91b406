"""Switches as roslaunch reads them: true, false, 1 or 0, in capitals or not."""

from __future__ import annotations

from collections.abc import Mapping


def switch(word: str) -> bool:
    """Return what a word says; also a type for argparse.

    Raises:
        ValueError: It is none of the four.
    """
    if word.lower() not in ("true", "1", "false", "0"):
        raise ValueError(f"true or false, not {word!r}")
    return word.lower() in ("true", "1")


def is_on(settings: Mapping[str, str], name: str, usual: bool = True) -> bool:
    """Return whether a setting of a launch file is on; `usual` where nobody has set it.

    Raises:
        RuntimeError: It is neither true nor false, and each program would make something else of it.
    """
    word = settings.get(name)
    try:
        return usual if word is None else switch(word)
    except ValueError as error:
        raise RuntimeError(f"{name}:={word}: {error}") from None
