"""The table at the end of `./stack test attacks`, on attacks that are made up."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

CONFTEST = Path(__file__).parent / "attacks" / "conftest.py"
HELD = "import pytest\n@pytest.mark.parametrize('n', range(3))\ndef test_by_force(n): pass\n"
MIXED = """
import pytest
pytestmark = pytest.mark.xdist_group("/a/file.py")
@pytest.fixture
def program(): raise RuntimeError("it does not start")
def test_one(): assert False, "the robot drove"
def test_two(): pass
def test_three(program): pass
def test_four(): pytest.skip("not today")
@pytest.mark.xfail
def test_five(): assert False
"""


@pytest.fixture
def attacks(pytester: pytest.Pytester) -> pytest.Pytester:
    pytester.makeconftest(CONFTEST.read_text())
    pytester.makepyfile(test_drive_wire=HELD)
    return pytester


def test_attacks_that_fail_are_counted_and_the_run_is_green(attacks):
    result = attacks.runpytest_inprocess("--attacks")
    result.stdout.re_match_lines([r"attacks on +tried +through +not decided", r"drive wire +3 +0$"])
    result.stdout.fnmatch_lines(["3 attacks tried, 0 through"])
    assert result.ret == 0


@pytest.mark.parametrize("workers", [(), ("-n", "2", "--dist", "loadgroup")], ids=["alone", "side by side"])
def test_what_gets_through_or_is_not_decided_is_named_and_red(attacks, workers):
    attacks.makepyfile(test_files=MIXED)
    result = attacks.runpytest_inprocess("--attacks", *workers)
    result.stdout.re_match_lines([r"drive wire +3 +0$", r"files +5 +2 +2$"])
    result.stdout.fnmatch_lines(
        [
            "through: test_files.py::test_five",
            "through: test_files.py::test_one",
            "not decided: test_files.py::test_four",
            "not decided: test_files.py::test_three",
            "8 attacks tried, 2 through, 2 not decided",
        ]
    )
    assert result.ret == 1


@pytest.mark.parametrize(
    "text",
    [
        "import no_such_module\n",
        "import pytest\ndef test_it(): pytest.skip('no')\n",
        "import pytest\n@pytest.mark.xfail\ndef test_it(): assert False\n",
    ],
    ids=["an import that fails", "a skip", "an expected failure"],
)
def test_nothing_but_attacks_that_were_held_off_is_green(attacks, text):
    attacks.makepyfile(test_files=text)
    assert attacks.runpytest_inprocess("--attacks").ret != 0


def test_an_ordinary_run_has_no_table(attacks):
    result = attacks.runpytest_inprocess()
    result.stdout.no_fnmatch_line("*attacks tried*")
    assert result.ret == 0
