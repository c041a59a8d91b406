"""The vendor's package and ours, for tests of what both must do."""

from __future__ import annotations

import importlib
from typing import Any

import pytest


@pytest.fixture(
    scope="module", params=[pytest.param("qi", marks=pytest.mark.vendor), "telepresence.naoqi"], ids=["libqi", "ours"]
)
def qi(request: pytest.FixtureRequest) -> Any:
    module = importlib.import_module(request.param)
    module.logging.setLevel(module.logging.SILENT)
    yield module
    module.logging.setLevel(module.logging.INFO)
