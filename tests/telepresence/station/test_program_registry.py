"""What a supervisor writes down of a program that it has started."""

import os

import pytest

from telepresence.station import program_registry, vitals
from telepresence.station.program_registry import Running


def test_who_takes_its_place_reads_what_runs(tmp_path):
    ours = Running("/camera", os.getpid(), vitals.start_time(os.getpid()), ["camera.py", "__name:=camera"], 7)
    program_registry.remember(tmp_path, ours)
    assert program_registry.recall(tmp_path, "/camera") == ours and ours.lives
    assert program_registry.everything(tmp_path) == [ours]
    assert program_registry.recall(tmp_path, "/another") is None


def test_it_never_waits_for_the_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda descriptor: pytest.fail("a busy disk takes seconds"))
    program_registry.remember(tmp_path, Running("/camera", 1, 1, []))
    assert program_registry.recall(tmp_path, "/camera") is not None
