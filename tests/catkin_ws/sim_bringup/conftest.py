"""Three machines that are far apart; see `tests/bench/media/far_network.py`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from media.far_network import FarNetwork


@pytest.fixture(scope="module")
def far_network() -> Iterator:
    """The pilot's machine, the Robotino's and the Pepper's."""
    made = FarNetwork(3)
    yield made
    made.close()
