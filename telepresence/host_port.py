"""Where a robot's program listens, as people type it."""

from __future__ import annotations


def parse_host_port(text: str, default_port: int, whose: str) -> tuple[str, int]:
    """Return host and port of `host` or `host:port`.

    Args:
        default_port: The port of a text without one.
        whose: Whose address it is, for an error's text: "a robot".
    Raises:
        ValueError: It is neither; the text says what is wrong.
    """
    text = text.strip()
    host, colon, port = text.rpartition(":") if text.count(":") == 1 else (text, "", "")
    if not host or any(letter.isspace() or letter == "/" for letter in host) or not _can_be_asked_for(host):
        raise ValueError(f"not the address of {whose}: {text!r}; expected host or host:port")
    if colon and not (port.isdecimal() and 0 < int(port) < 65536):
        raise ValueError(f"{port!r} is not a port, in {text!r}")
    return host.strip("[]"), int(port) if colon else default_port


def _can_be_asked_for(host: str) -> bool:
    """Whether a name server takes it: not with two dots in a row, for example, nor with parts of over 63 letters."""
    try:
        host.encode("idna")
    except UnicodeError:
        return False
    return True
