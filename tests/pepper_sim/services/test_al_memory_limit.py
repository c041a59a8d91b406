"""ALMemory without a wire: it cannot be filled."""

import pytest

from pepper_sim.naoqi.memory_size import MOMENT, SMALL, size_of, weight_of
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
    assert [value[0] for value, *_ in memory.getEventHistory("picture")] == [96, 97, 98, 99]
    assert [value for value, *_ in memory.getEventHistory("count")] == list(range(68, 100))
    memory.removeMicroEvent("other")
    assert memory._past == pytest.approx(3 * 10_000 + (4 + 32) * MOMENT, rel=0.01), "what is gone weighs nothing"
    memory.removeData("picture")
    assert memory._bytes == 0
    assert [value[0] for value, *_ in memory.getEventHistory("picture")] == [97, 98, 99], "the newest weighs now, too"


def test_a_value_that_is_in_the_history_too_is_counted_once(monkeypatch, memory):
    monkeypatch.setattr(module, "_MAX_BYTES", 25_000)
    memory.raiseEvent("one", bytes(10_000))
    memory.raiseEvent("other", bytes(10_000))
    with pytest.raises(module.ServiceError, match="full"):
        memory.raiseEvent("third", bytes(10_000))


@pytest.mark.parametrize("size", [10, SMALL // 2, 10_000])
def test_all_histories_together_hold_few_bytes(monkeypatch, memory, size):
    monkeypatch.setattr(module, "_MAX_HISTORIES_BYTES", 100_000)
    for event in range(100):
        for number in range(32):
            memory.raiseEvent(f"e{event}", bytes([number]) * size)
    histories = [[value for value, *_ in memory.getEventHistory(f"e{event}")] for event in range(100)]
    assert sum(MOMENT + size for history in histories for _ in history[1:]) < 100_000
    assert all(history[-1] == bytes([31]) * size for history in histories), "the newest is there"
    memory.raiseEvent("large", bytes(500_000))
    memory.insertData("large", 1)
    assert memory.getEventHistory("large") == [], "what is the value of no key any more does not stay"


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
    assert size_of(5) == 0 < size_of("short") < size_of([1.0] * 10)
    assert weight_of(size_of("short")) == weight_of(size_of([1.0] * 10)) == 0
    assert weight_of(size_of([["a" * 50_000], ("b" * 50_000,)])) == pytest.approx(100_000, rel=0.05)
    assert size_of({"key": [bytes(1000)] * 3}) == pytest.approx(3_000, rel=0.3)
