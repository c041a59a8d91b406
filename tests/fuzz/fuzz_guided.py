"""Inputs that atheris (libFuzzer) chooses by what they reach in a parser; `python tests/fuzz` runs it for each target.

    python fuzz_guided.py NAME INPUTS SEED FOLDER

FOLDER is for the valid inputs as files. libFuzzer never returns, so this process ends when it has fed so many; its last
line is a JSON object: inputs, seconds, growth [bytes], slowest [s], or, for a find, inputs, text and file.
"""

from __future__ import annotations

import json
import logging
import os
import random
import sys
import traceback
from pathlib import Path
from typing import Any

from fuzz_harness import FOUND, Checker, Find
from fuzz_mutations import Mutator
from fuzz_targets import TARGETS

OURS = ["telepresence", "telepresence_1", "rto_node", "rto_bringup", "naoqi_driver", "pepper_sensors", "pepper_sim"]
"""Packages in which atheris sees which lines and comparisons an input reaches."""
LONGEST_INPUT = 60
"""Seconds after which libFuzzer ends an input that does not come back, and keeps it."""


def main() -> None:
    import atheris

    name, inputs, seed, folder = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    with atheris.instrument_imports(include=[*OURS, "robotino_sim", "json.decoder", "aiortc.sdp"]):
        target = TARGETS[name]()
    for number, valid in enumerate(target.seeds):
        Path(folder, str(number)).write_bytes(valid)
    logging.disable(logging.CRITICAL)
    check = Checker(target, inputs)
    left = inputs

    def feed(data: bytes) -> None:
        nonlocal left
        try:
            check(data)
            left -= 1
            if left <= 0:
                end(check.finish()._asdict())
        except Find as find:
            traceback.print_exception(find.__cause__ or find)
            end({"inputs": inputs - left, "text": str(find), "file": str(find.save(name)) if find.data else ""})

    def mutate(data: bytes, longest: int, number: int) -> bytes:
        if number % 2:
            return atheris.Mutate(data, longest)
        mutator = Mutator((*target.seeds, data), longest, number)
        return mutator.changed(data) if number % 4 else mutator.new()

    (FOUND / name).mkdir(parents=True, exist_ok=True)
    options = {
        "seed": random.Random(seed).randrange(1, 1 << 31),
        "runs": -1,
        "max_len": target.longest,
        "timeout": LONGEST_INPUT,
        "rss_limit_mb": 0,
        "verbosity": 0,
        "artifact_prefix": f"{FOUND / name}/",
    }
    atheris.Setup(["fuzz", *(f"-{key}={value}" for key, value in options.items()), folder], feed, custom_mutator=mutate)
    atheris.Fuzz()


def end(report: dict[str, Any]) -> None:
    """Print the last line, and be gone: libFuzzer would go on."""
    print(json.dumps(report), flush=True)
    os._exit(1 if "text" in report else 0)


if __name__ == "__main__":
    main()
