from __future__ import annotations

import pytest

from telepresence.video.foreign_sdp import MAX_CANDIDATES, MAX_LINE, MAX_LINES, MAX_SECTIONS, checked

HERE, THERE = (f"a=candidate:1 1 udp 1 {at} 5000 typ host" for at in ("192.0.2.1", "192.0.2.2"))
NAMED = "a=candidate:1 1 udp 1 0a1b.local 5000 typ host"
END = "a=end-of-candidates"


def sdp(*lines: str) -> str:
    return "".join(f"{line}\r\n" for line in ("v=0", "m=video 9 UDP/TLS/RTP/SAVPF 97", *lines))


def test_only_candidates_of_the_other_end_are_kept() -> None:
    assert checked(sdp(HERE, THERE, NAMED, END), "192.0.2.1") == sdp(HERE)
    assert checked(sdp(HERE, THERE, END), "192.0.2.1", "192.0.2.2") == sdp(HERE, THERE, END)
    assert checked(sdp(HERE, THERE, NAMED, END)) == sdp(HERE, THERE, NAMED, END)


@pytest.mark.parametrize(
    "text",
    [
        sdp("a=" + "x" * MAX_LINE),
        sdp(*["a=x"] * MAX_LINES),
        sdp(*["m=audio 9 RTP 96"] * MAX_SECTIONS),
        sdp("m=application 9 UDP/DTLS/SCTP webrtc-datachannel"),
        sdp(*[HERE] * (MAX_CANDIDATES + 1)),
    ],
)
def test_what_is_too_much_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="description"):
        checked(text, "192.0.2.1")
