"""Who waits for a robot that starts at the same time says nothing for a while."""

from telepresence import start_patience
from telepresence.start_patience import StartPatience


def test_it_is_over_after_its_time_or_once_what_was_waited_for_was_there(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(start_patience.time, "monotonic", lambda: clock[0])
    waits, works = StartPatience(), StartPatience()
    works.works()
    assert works.over and not waits.over
    clock[0] += start_patience.PATIENCE
    assert waits.over


def test_who_starts_the_station_may_give_it_more_time(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(start_patience.time, "monotonic", lambda: clock[0])
    monkeypatch.setenv(start_patience.VARIABLE, str(start_patience.PATIENCE_WITH_SIMULATION))
    waits = StartPatience()
    clock[0] += start_patience.PATIENCE
    assert not waits.over
    clock[0] += start_patience.PATIENCE_WITH_SIMULATION
    assert waits.over
