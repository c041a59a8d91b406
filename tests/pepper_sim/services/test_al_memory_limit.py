"""ALMemory without a wire: it cannot be filled."""

import pytest


def test_the_memory_cannot_be_filled(monkeypatch):
    from pepper_sim.services import al_memory as module

    monkeypatch.setattr(module, "_MAX_KEYS", 10)
    memory = module.ALMemory(lambda: None, {}, None)
    with pytest.raises(module.ServiceError, match="full"):
        for number in range(20):
            memory.insertData(f"k{number}", number)
    with pytest.raises(module.ServiceError, match="full"):
        for number in range(20):
            memory.declareEvent(f"e{number}")
