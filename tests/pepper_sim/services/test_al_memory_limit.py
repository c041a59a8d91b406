"""ALMemory without a wire: it cannot be filled."""

import pytest

from pepper_sim.naoqi.memory_size import SMALL, weight_of
from pepper_sim.services import al_memory as module


@pytest.fixture
def memory():
    return module.ALMemory(lambda: None, {}, None)


def test_the_memory_cannot_be_filled(monkeypatch, memory):
    monkeypatch.setattr(module, "_MAX_KEYS", 10)
    with pytest.raises(module.ServiceError, match="full"):
        for number in range(20):
            memory.insertData(f"k{number}", number)
    with pytest.raises(module.ServiceError, match="full"):
        for number in range(20):
            memory.declareEvent(f"e{number}")


def test_large_values_are_refused_when_they_are_too_many_and_small_ones_are_not(monkeypatch, memory):
    monkeypatch.setattr(module, "_MAX_BYTES", 100_000)
    with pytest.raises(module.ServiceError, match="full"):
        for number in range(20):
            memory.insertData(f"k{number}", bytes(10_000))
    assert not memory._known("k19") and memory.getData("k3") == bytes(10_000)
    memory.insertData("small", bytes(SMALL // 2))
    memory.raiseEvent("event", [1, 2, 3])
    memory.store("own", bytes(10_000))  # by one of the robot's services
    memory.removeData("own")
    memory.insertData("k0", bytes(10_000))
    memory.removeData("k0")
    memory.insertData("k19", bytes(10_000))
    assert memory.getData("k19") == bytes(10_000), "there was room again"


def test_the_history_of_an_event_holds_few_large_values(monkeypatch, memory):
    monkeypatch.setattr(module, "_MAX_HISTORY_BYTES", 35_000)
    for number in range(100):
        memory.raiseEvent("picture", bytes([number]) * 10_000)
        memory.raiseMicroEvent("other", bytes([number]) * 10_000)
        memory.raiseEvent("count", number)
    assert [value[0] for value, *_ in memory.getEventHistory("picture")] == [97, 98, 99]
    assert [value for value, *_ in memory.getEventHistory("count")] == list(range(68, 100))
    held = memory._bytes
    memory.removeMicroEvent("other")
    memory.insertData("picture", 1)
    assert memory._bytes == pytest.approx(3 / 8 * held, rel=0.01), "what is gone weighs nothing"


def test_a_full_memory_forgets_histories_first(monkeypatch, memory):
    monkeypatch.setattr(module, "_MAX_BYTES", 35_000)
    for _ in range(10):
        memory.raiseEvent("picture", bytes(10_000))
    assert 0 < len(memory.getEventHistory("picture")) < 4


def test_keys_and_descriptions_are_short(memory):
    for call in (memory.insertData, memory.raiseEvent):
        with pytest.raises(module.ServiceError, match="letters"):
            call("k" * 5000, 1)
    with pytest.raises(module.ServiceError, match="letters"):
        memory.setDescription("key", "d" * 5000)
    assert memory.getMicroEventList() == []
    with pytest.raises(module.ServiceError, match="letters"):
        memory.raiseMicroEvent("k" * 5000, 1)
    assert memory.getMicroEventList() == []


def test_a_value_weighs_what_is_in_it():
    assert weight_of(5) == weight_of("short") == weight_of([1.0] * 10) == 0
    assert weight_of([["a" * 50_000], ("b" * 50_000,)]) == pytest.approx(100_000, rel=0.05)
    assert weight_of({"key": [bytes(1000)] * 3}) == pytest.approx(3_000, rel=0.3)
