"""`./stack fuzz [NAME ...] [--inputs N] [--seed N]`: damaged inputs for every parser of bytes from outside.

Of each input: nothing but the documented exception, at most 100 times as long as a valid one; of all of them: no growth
of memory. What breaks that is written to tests/fuzz/found/NAME, where a test replays it from then on.

atheris (libFuzzer for Python, from its own lock requirements/fuzz.txt) chooses the inputs by what they reach: beside
the changes of `fuzz_mutations` that finds what random ones do not in years. `--plain` does without. (hypothesis, which
the other tests use, makes some hundred inputs a second, too few for a million.)
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SOURCES = [HERE, ROOT, *sorted(ROOT.glob("catkin_ws/src/*/src"))]
TOOL = ROOT / ".venv" / "tools" / "fuzz"


def main() -> int:
    sys.path[:0] = list(map(str, SOURCES))
    from fuzz_targets import TARGETS

    parser = argparse.ArgumentParser(prog="./stack fuzz", description="Damaged inputs for parsers of outside bytes.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of: {', '.join(TARGETS)}; default all")
    parser.add_argument("--inputs", type=int, default=1_000_000, help="inputs for each parser; default 1000000")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random numbers; default 1")
    parser.add_argument("--plain", action="store_true", help="random changes only, without atheris")
    arguments = parser.parse_args()
    unknown = set(arguments.names) - set(TARGETS)
    if unknown:
        parser.error(f"there is no {', '.join(sorted(unknown))}; known: {', '.join(TARGETS)}")
    print(f"{'target':<16} {'inputs':>9} {'per s':>7} {'grown':>8} {'slowest':>9}   seed {arguments.seed}", flush=True)
    finds = [name for name in arguments.names or TARGETS if not fuzz(name, arguments)]
    print(f"finds: {', '.join(finds) or 'none'}")
    return 1 if finds else 0


def fuzz(name: str, arguments: argparse.Namespace) -> bool:
    """Run one target in a process of its own and print its row; whether nothing was found."""
    program = "fuzz_plain.py" if arguments.plain else "fuzz_guided.py"
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile("w+") as said:
        command = [sys.executable, HERE / program, name, str(arguments.inputs), str(arguments.seed), folder]
        path = os.pathsep.join([*map(str, SOURCES), str(TOOL), os.environ.get("PYTHONPATH", "")])
        environment = {**os.environ, "PYTHONPATH": path, "OPENCV_LOG_LEVEL": "SILENT"}
        process = subprocess.run(command, stdout=subprocess.PIPE, stderr=said, text=True, env=environment)
        said.seek(0, os.SEEK_END)
        said.seek(max(0, said.tell() - 6000))
        end = said.read()
    try:
        report = json.loads(process.stdout.splitlines()[-1])
    except (IndexError, ValueError):  # the interpreter itself has crashed, or libFuzzer has ended it
        text = f"it ended with {process.returncode}: see what it said last, and the newest file in found/{name}"
        report = {"inputs": 0, "text": text}
    if "text" in report:
        print(f"{name:<16} {report['inputs']:>9}   FIND: {report['text']}", flush=True)
        print(report.get("file", ""), end, sep="\n", flush=True)
        return False
    rate, growth = report["inputs"] / report["seconds"], f"{report['growth'] / 1e6:.1f} MB"
    print(f"{name:<16} {report['inputs']:>9} {rate:>7.0f} {growth:>8} {report['slowest'] * 1e3:>6.2f} ms", flush=True)
    return True


if __name__ == "__main__":
    sys.exit(main())
