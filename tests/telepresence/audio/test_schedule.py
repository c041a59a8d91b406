"""Pieces that arrive unevenly, placed on an invented clock."""

from __future__ import annotations

import itertools
import random

import pytest

from telepresence.audio.schedule import Schedule


def test_late_pieces_within_the_lead_leave_no_seam() -> None:
    schedule, chance = Schedule(lead=0.05, most=0.15), random.Random(1)
    moments = [schedule.place(n * 0.02 + chance.random() * 0.04, 0.02) for n in range(500)]
    assert not any(seam for _, seam in moments[1:])
    gaps = [after[0] - before[0] for before, after in itertools.pairwise(moments)]
    assert min(gaps) > 0.0195 and max(gaps) < 0.0205


def test_a_sender_with_another_clock_is_followed() -> None:
    schedule = Schedule(lead=0.05, most=0.15)
    for n in range(200_000):
        arrival = n * 0.02 * 1.0002  # 200 ppm slow
        due, seam = schedule.place(arrival, 0.02)
        assert not seam or n == 0
    assert due - arrival == pytest.approx(0.05, abs=0.01)


def test_a_pause_costs_one_seam_and_its_backlog_is_dropped() -> None:
    schedule = Schedule(lead=0.05, most=0.15)
    for n in range(50):
        schedule.place(n * 0.02, 0.02)
    burst = [schedule.place(2.0, 0.02) for _ in range(50)]
    assert burst[0] == (pytest.approx(2.05), True)
    kept = [due for due, _ in burst if due is not None]
    assert len(kept) <= 6 and max(kept) <= 2.15
    after = [schedule.place(2.0 + n * 0.02, 0.02)[0] for n in range(1, 1000)]
    assert after[-1] - (2.0 + 999 * 0.02) == pytest.approx(0.05, abs=0.005), "the delay stays"


def test_the_pace_is_found_before_anything_is_played() -> None:
    schedule = Schedule(lead=0.01, most=0.1, settle=0.8)
    late = [0.06, 0.03, 0.0, *([0.004] * 40)]
    moments = [schedule.place(n * 0.085 + late[n], 0.085) for n in range(len(late))]
    first = next(n for n, (due, _) in enumerate(moments) if due is not None)
    assert 8 <= first <= 11, "a second is left out"
    assert moments[first][0] - first * 0.085 == pytest.approx(0.01, abs=0.004), "the pace of a late beginning stays"
