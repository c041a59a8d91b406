"""Old commands are distinguished from new ones by how they arrive."""

from __future__ import annotations

from telepresence.teleop.stale_command_filter import CALM, StaleCommandFilter


def judge(stream: StaleCommandFilter, times: list[float]) -> list[bool]:
    return [stream.is_stale(now) for now in times]


def test_a_pilot_who_repeats_is_believed_from_the_first_command_on():
    assert not any(judge(StaleCommandFilter(), [10.0 + 0.1 * i for i in range(20)]))
    assert not any(judge(StaleCommandFilter(), [0.0, 5.0, 5.1, 60.0]))


def test_two_programs_that_both_drive_are_believed():
    assert not any(
        judge(StaleCommandFilter(), sorted([0.1 * i for i in range(20)] + [0.1 * i + 0.002 for i in range(20)]))
    )


def test_a_fast_sender_is_believed():
    assert not any(judge(StaleCommandFilter(), [0.01 * i for i in range(300)])), "a gamepad with 100 Hz"
    steady = [0.1 * i for i in range(30)]
    assert not any(judge(StaleCommandFilter(), [*steady, 2.95, 2.951, 2.952, 2.953])), "a busy machine; nothing was cut"


def test_a_burst_is_not_believed_until_it_is_calm():
    burst = [3.0 + 0.0005 * i for i in range(50)]
    late = judge(StaleCommandFilter(), [0.0, 0.1, *burst])
    assert not any(late[:4]) and all(late[4:]), "the first two cannot be told from two programs"
    stream = StaleCommandFilter()
    judge(stream, burst)
    assert stream.is_stale(burst[-1] + CALM - 0.01)
    assert not stream.is_stale(burst[-1] + CALM + 0.05)


def test_after_a_lost_link_nothing_is_believed_at_first():
    """TCP starts slowly: one old command, after a round trip two, then four, ..."""
    stream = StaleCommandFilter()
    judge(stream, [0.0, 0.1])
    stream.link_lost()
    rounds = [(5.0, 1), (5.12, 2), (5.24, 4), (5.36, 8), (5.48, 16)]
    assert all(judge(stream, [start + 0.0003 * i for start, count in rounds for i in range(count)]))
    assert not any(judge(stream, [5.9, 6.0, 6.1])), "the pilot goes on"
