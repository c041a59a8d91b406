"""A loudspeaker that is muted while it is opened."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from telepresence.audio.output import Output
from telepresence.audio.pipeline import Gst


@pytest.fixture
def output(monkeypatch: pytest.MonkeyPatch) -> Iterator[Output]:
    """Its `opening` is called when its pipeline is ready, and before that starts, which takes a while on a device."""
    output = Output("loudspeaker", "test", "audiotestsrc is-live=true ! audioconvert")
    output.opening = lambda: None
    prepare = output.pipeline._prepare

    def prepare_slowly(pipeline: Gst.Pipeline) -> None:
        prepare(pipeline)
        output.opening()

    output.pipeline._prepare = prepare_slowly
    yield output
    output.close()


def test_what_is_muted_while_it_is_opened_is_muted(output: Output, wait_until: Callable) -> None:
    def is_muted() -> bool | None:
        volume = output.pipeline.get("volume")
        return None if volume is None else volume.get_property("mute")

    for runs, muted in enumerate((True, False), 1):

        def change(muted: bool = muted) -> None:
            output.muted = muted

        output.opening = change
        output.start() if runs == 1 else output.pipeline.reopen()
        wait_until(lambda runs=runs: output.pipeline.runs == runs and is_muted() is not None, "it is open")
        assert is_muted() is muted
        output.muted = not muted
        assert is_muted() is not muted, "and while it plays"
