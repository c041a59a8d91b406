"""Each target of `./stack fuzz` gets a few inputs, and all that once broke it; the harness finds planted faults."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator

import fuzz_harness
import pytest
from fuzz_harness import Find, Target, found, run
from fuzz_mutations import Mutator
from fuzz_targets import TARGETS

INPUTS = 14
"""Inputs for each target: some 300 in all. `./stack fuzz` feeds a million each."""


@pytest.fixture(autouse=True)
def nothing_of_other_tests_is_collected() -> Iterator[None]:
    """Looking for growth goes through all objects that there are, several times: those of this test are enough."""
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.mark.parametrize("name", TARGETS)
def test_a_parser_of_outside_bytes_holds(name):
    target = TARGETS[name]()
    run(target, INPUTS, seed=len(name))
    check = fuzz_harness.Checker(target, 0)
    for path in found(name):
        check(path.read_bytes())


def test_every_input_that_is_kept_belongs_to_a_target():
    assert {path.name for path in fuzz_harness.FOUND.iterdir() if path.is_dir()} <= set(TARGETS)


def test_the_same_seed_makes_the_same_inputs_and_each_is_short_enough():
    seeds = (b'{"a": [1, 2]}', b"x" * 50)
    first, again, other = (Mutator(seeds, 60, seed) for seed in (1, 1, 2))
    made = [first.new() for _ in range(200)]
    assert made == [again.new() for _ in range(200)] != [other.new() for _ in range(200)]
    assert len(set(made)) > 150 and max(map(len, made)) <= 60


def crash(data: bytes) -> None:
    if b"[[" in data:
        raise IndexError("pop from an empty list")


def hang(data: bytes) -> None:
    if len(data) > 30:
        end = time.thread_time() + 0.05
        while time.thread_time() < end:
            pass


KEPT: list[object] = []


@pytest.mark.parametrize(
    ("feed", "inputs", "what"),
    [
        (crash, 3000, "IndexError: pop from an empty list"),
        (hang, 3000, "bytes take 0.0"),
        (lambda data: KEPT.append([data]), 6000, "objects more are held"),
    ],
    ids=["an exception", "a slow input", "growth"],
)
def test_a_planted_fault_is_found_and_kept(feed, inputs, what, tmp_path):
    with pytest.raises(Find, match=what) as caught:
        run(Target(feed, (b'{"a": [1, 2]}',), (ValueError,)), inputs, seed=1)
    KEPT.clear()
    path = caught.value.save("planted", tmp_path)
    assert path.parent == tmp_path / "planted" and path.read_bytes() == caught.value.data


def test_a_target_whose_valid_input_is_refused_is_none():
    def refuse(_data: bytes) -> None:
        raise ValueError("no")

    with pytest.raises(Find, match="a valid input is refused"):
        run(Target(refuse, (b"valid",), (ValueError,)), 1, seed=1)
