"""Session descriptions that come from elsewhere: how much of one is read, and whom it may make us talk to."""

from __future__ import annotations

import ipaddress
from collections.abc import Collection, Sequence

MAX_SDP = 64 * 1024
"""Characters."""
MAX_LINES, MAX_LINE = 1000, 2000
MAX_SECTIONS = 4
"""Pictures and sounds in one description."""
MAX_CANDIDATES = 32
KINDS = frozenset({"audio", "video"})
CHANNELS = "application"
"""A section of data channels (RFC 8841)."""


def checked(sdp: str, *addresses: str, kinds: Collection[str] = KINDS) -> str:
    """Return a description that may be handed to aiortc.

    Args:
        addresses: Where the other end may be: candidates (ICE) elsewhere are left out, so that nobody makes this
            machine send something to somebody else; without any, all are kept.
        kinds: What its sections may be of.
    Raises:
        ValueError: It is too large, or holds something else than sound and pictures.
    """
    lines = sdp.splitlines()
    if len(sdp) > MAX_SDP or len(lines) > MAX_LINES or max(map(len, lines), default=0) > MAX_LINE:
        raise ValueError("the description is too long")
    sections = [line for line in lines if line.startswith("m=")]
    if len(sections) > MAX_SECTIONS:
        raise ValueError(f"the description has {len(sections)} sections, and {MAX_SECTIONS} are the limit")
    for section in sections:
        kind = section[2:].partition(" ")[0]
        if kind not in kinds:
            raise ValueError("the description is of something else than sound and pictures")
    candidates = [line for line in lines if line.startswith("a=candidate:")]
    if len(candidates) > MAX_CANDIDATES:
        raise ValueError(f"the description names {len(candidates)} addresses, and {MAX_CANDIDATES} are the limit")
    strangers = {line for line in candidates if addresses and not _is_at(line, addresses)}
    if not strangers:
        return sdp
    # Without the line that ends them, the other end's own packets may still show where it is.
    kept = (line for line in lines if line not in strangers and line != "a=end-of-candidates")
    return "".join(f"{line}\r\n" for line in kept)


def _is_at(candidate: str, addresses: Sequence[str]) -> bool:
    words = candidate.split()
    try:
        return len(words) > 4 and ipaddress.ip_address(words[4]) in map(ipaddress.ip_address, addresses)
    except ValueError:  # a name, which would have to be looked up
        return False
