"""Random changes only, without atheris: as `fuzz_guided`, for computers that have none."""

from __future__ import annotations

import json
import sys

from fuzz_harness import Find, run
from fuzz_targets import TARGETS


def main() -> int:
    name, inputs, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    try:
        report = run(TARGETS[name](), inputs, seed)._asdict()
    except Find as find:
        report = {"inputs": 0, "text": str(find), "file": str(find.save(name)) if find.data else ""}
    print(json.dumps(report))
    return 1 if "text" in report else 0


if __name__ == "__main__":
    sys.exit(main())
