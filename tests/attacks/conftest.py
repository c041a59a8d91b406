"""`./stack test attacks`: how many attacks were tried, and how many got through.

Every test of this folder is an attack on a running program, and each of its parameters is one of its own. It passes
when the attack fails. With `--attacks` the run ends with a table: a file is a topic; a test that fails has let its
attack through; one that could not be tried to its end (a fixture's error, a skip, a file that cannot be imported) is
not decided.
"""

from __future__ import annotations

from collections import Counter
from pathlib import PurePath

import pytest
from _pytest.terminal import TerminalReporter

HELD, THROUGH, UNDECIDED = "held", "through", "not decided"
BADNESS = [HELD, UNDECIDED, THROUGH]
PLUGIN = "attacks table"


class AttackTable:
    """Outcome of each attack, from the reports of its setup, call and teardown; also in pytest-xdist's controller."""

    def __init__(self, config: pytest.Config) -> None:
        self._grouped = config.getoption("dist", default="no") == "loadgroup"
        self.outcomes: dict[str, str] = {}
        """Node id -> one of BADNESS."""

    def _note(self, name: str, outcome: str) -> None:
        if self._grouped:  # then pytest-xdist appends @ and the name of the group
            name = name.rpartition("@")[0] or name
        self.outcomes[name] = max(outcome, self.outcomes.get(name, HELD), key=BADNESS.index)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if hasattr(report, "wasxfail"):
            self._note(report.nodeid, THROUGH)  # known, and still through
        elif report.when == "call" and report.outcome != "skipped":
            # "rerun" is a failure that is tried again: once through is through.
            self._note(report.nodeid, HELD if report.passed else THROUGH)
        elif not report.passed:
            self._note(report.nodeid, UNDECIDED)  # "???" of a worker that died is one of these

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if not report.passed:
            self._note(report.nodeid, UNDECIDED)

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        if exitstatus == pytest.ExitCode.OK and set(self.outcomes.values()) != {HELD}:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: TerminalReporter) -> None:
        topics: dict[str, Counter[str]] = {}
        for name, outcome in sorted(self.outcomes.items()):
            topic = PurePath(name.partition("::")[0]).stem.removeprefix("test_").replace("_", " ")
            topics.setdefault(topic, Counter())[outcome] += 1
        width = max(map(len, [*topics, "attacks on"]))
        terminalreporter.section("attacks")
        terminalreporter.line(f"{'attacks on':<{width}}  tried  through  not decided")
        for topic, counts in topics.items():
            line = f"{topic:<{width}}  {counts.total():5}  {counts[THROUGH]:7}  {counts[UNDECIDED] or '':>11}".rstrip()
            terminalreporter.line(line, red=counts[HELD] != counts.total())
        for outcome in (THROUGH, UNDECIDED):
            for name in (name for name, found in sorted(self.outcomes.items()) if found == outcome):
                terminalreporter.line(f"{outcome}: {name}", red=True)
        total = Counter(self.outcomes.values())
        undecided = f", {total[UNDECIDED]} not decided" if total[UNDECIDED] else ""
        held = 0 < total[HELD] == total.total()
        text = f"{total.total()} attacks tried, {total[THROUGH]} through{undecided}"
        terminalreporter.line(text, red=not held, green=held)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--attacks", action="store_true", help="end with a table of the attacks: tried and through")


def pytest_configure(config: pytest.Config) -> None:
    # The option is missing when this file is read late, by a run of more than this folder: then there is no table.
    if config.getoption("--attacks", default=False) and not hasattr(config, "workerinput"):
        config.pluginmanager.register(AttackTable(config), PLUGIN)
