"""Every benchmark can be started: they are run by hand, where nobody would notice that what they import has moved."""

import subprocess
import sys
from pathlib import Path

BENCHMARKS = Path(__file__).parent

IMPORT_ALL = """
import runpy, sys
named = runpy.run_path("__main__.py")
for name in [*named["BENCHMARKS"], *named["PROGRAMS"]]:
    __import__("bench_" + name)
    print(name)
"""


def test_every_benchmark_that_the_help_names_can_be_imported():
    run = subprocess.run([sys.executable, "-c", IMPORT_ALL], cwd=BENCHMARKS, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.split() and sorted(run.stdout.split()) == sorted(
        path.stem.removeprefix("bench_") for path in BENCHMARKS.glob("bench_*.py")
    )
