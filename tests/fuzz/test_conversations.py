"""Damaged conversations in little, and every one that once broke something; `fuzz_conversations` plays a million."""

from __future__ import annotations

import pytest
from fuzz_conversation_ends import NAME, ServerSide
from fuzz_conversations import SIDES, fuzz
from fuzz_harness import FOUND

FOUND_BATCHES = sorted((FOUND / NAME).glob("server-*.bin"))


@pytest.mark.parametrize("side", SIDES)
def test_an_end_survives_damaged_messages(side: str) -> None:
    row = fuzz(side, 2000, seed=7, progress=False)
    assert row.messages == 2000 and row.connections > 0


def test_a_batch_that_was_found_breaks_nothing_any_more() -> None:
    end = ServerSide(seed=1)
    try:
        for path in FOUND_BATCHES:
            end.play(path.read_bytes())
            end.served(path.read_bytes())
    finally:
        end.close()
