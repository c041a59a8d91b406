"""Lets pytest run the rostests of the workspace, src/PACKAGE/test/NAME.test: each is one test.

It is run as `catkin_make run_tests` does it, so that its results are in build/test_results, where `catkin_test_results`
looks. A comment `<!-- pytest: MARKER ... -->` in the file adds markers to `ros`.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from telepresence.station import processes

collect_ignore_glob = ["src/*/test/*.py"]
"""The programs of the rostests, which pytest would take for modules of its own."""
WORKSPACE = Path(__file__).resolve().parent
RESULTS = WORKSPACE / "build" / "test_results"
RUN = '. "$0/../env.sh" && exec rostest "$@"'
"""The command line for bash, with the workspace as its name: rostest in the project's environment."""
MARKERS = re.compile(r"<!-- pytest: ([\w ]+?) -->")
LINGERING = 5.0
"""Seconds that a program may outlive rostest."""
COMPLAINTS = ("escalating to SIG", "Traceback (most recent call last)")
"""What no node may print: roslaunch when one ignores SIGINT for 15 s, Python when one dies of an exception."""


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    if file_path.suffix == ".test" and file_path.parent.name == "test":
        return RostestFile.from_parent(parent, path=file_path)
    return None


class RostestFailed(Exception):
    """The text says what failed."""


class RostestFile(pytest.File):
    def collect(self) -> Iterator[pytest.Item]:
        yield Rostest.from_parent(self, name=self.path.stem)


class Rostest(pytest.Item):
    """One .test file."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.package = self.path.parents[1].name
        for name in ("ros", *(MARKERS.search(self.path.read_text()) or ["", ""])[1].split()):
            self.add_marker(name)

    def runtest(self) -> None:
        processes.adopt_orphans()
        before = {*processes.descendants()}
        for old in self._results():
            old.unlink(missing_ok=True)
        home = Path(tempfile.mkdtemp(prefix="rostest-"))
        try:
            code = self._run(home / "output")
            self._judge(code, (home / "output").read_text(errors="replace"), {*processes.descendants()} - before)
        finally:
            shutil.rmtree(home, ignore_errors=True)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        return str(excinfo.value) if excinfo.errisinstance(RostestFailed) else super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        return self.path, 0, f"rostest {self.package} {self.path.name}"

    def _run(self, output: Path) -> int:
        options = [f"--pkgdir={self.path.parents[1]}", f"--package={self.package}"]
        options += ["--results-filename", f"test_{self.name}.xml", "--results-base-dir", str(RESULTS)]
        with output.open("w") as target:
            rostest = processes.start(
                ["bash", "-c", RUN, str(WORKSPACE), *options, str(self.path)],
                env={**os.environ, "ROS_HOME": str(output.parent)},
                stdin=subprocess.DEVNULL,
                stdout=target,
                stderr=subprocess.STDOUT,
            )
            try:
                return rostest.wait()
            finally:  # the time limit of a test
                processes.end(rostest, patience=20.0)

    def _results(self) -> list[Path]:
        """What rostest writes about the launch, and what the test programs write."""
        names = re.findall(r'<test\b[^>]*\btest-name="(\w+)"', self.path.read_text())
        folder = RESULTS / self.package
        return [folder / f"rostest-test_{self.name}.xml", *(folder / f"rosunit-{name}.xml" for name in names)]

    def _judge(self, code: int, output: str, left: set[int]) -> None:
        """Raise RostestFailed if anything is wrong."""
        tests, problems = 0, []
        for path in self._results():
            if not path.exists():
                problems.append(f"{path.name} was not written")
                continue
            suite = ElementTree.parse(path).getroot()
            if path.name.startswith("rosunit-"):
                tests += int(suite.get("tests", "0"))
            for case in suite.iter("testcase"):
                problems += [
                    f"{case.get('name')}: {bad.text}" for tag in ("failure", "error") for bad in case.iter(tag)
                ]
            output += "".join(text.text or "" for text in suite.iter() if text.tag in ("system-out", "system-err"))
        if not tests:
            problems.append("no test was run")
        problems += [f"a node printed\n{_from(complaint, output)}" for complaint in COMPLAINTS if complaint in output]
        if lingering := self._end(left):
            problems.append(f"still running: {lingering}")
        if code or problems:
            tail = "\n".join(output.splitlines()[-60:])
            raise RostestFailed("\n".join([f"rostest ended with {code}", *problems, "", "what was printed:", tail]))

    def _end(self, left: set[int]) -> list[int]:
        """Wait for the end of what rostest has left, and end what does not; return that."""
        deadline = time.monotonic() + LINGERING
        while (left := left & {*processes.descendants()}) and time.monotonic() < deadline:
            time.sleep(0.05)
        for pid in left:
            processes.send(pid, signal.SIGKILL)
        return sorted(left)


def _from(words: str, output: str) -> str:
    """The line in which these words are, and those that follow: a traceback, whatever was printed after it."""
    begin = output.rindex("\n", 0, output.index(words)) + 1 if "\n" in output[: output.index(words)] else 0
    return "\n".join(output[begin:].splitlines()[:30])
