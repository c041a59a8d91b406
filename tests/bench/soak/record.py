"""The record of a soak: a file of JSON lines that grows while it runs, so that a run that is cut off is not lost."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from soak.samples import Usage


class Recorder:
    """Appends lines to the file of the record. All times are seconds since `began`, a monotonic time."""

    def __init__(self, path: Path, **about: Any) -> None:
        self._file = path.open("a", buffering=1)
        self._write({"about": about})

    def note(self, at: float, kind: str, text: str) -> None:
        """Append what happened."""
        self._write({"t": round(at, 2), "event": kind, "text": text})

    def sample(self, at: float, programs: dict[str, Usage], **totals: Any) -> None:
        """Append what every program uses."""
        values = {name: [*asdict(usage).values()] for name, usage in programs.items()}
        self._write({"t": round(at, 2), "programs": values, **totals})

    def close(self) -> None:
        self._file.close()

    def _write(self, line: dict[str, Any]) -> None:
        self._file.write(json.dumps(line, separators=(",", ":")) + "\n")


@dataclass
class Series:
    """One program's samples: times [s] and what it used then."""

    times: list[float] = field(default_factory=list)
    usages: list[Usage] = field(default_factory=list)
    phases: list[str] = field(default_factory=list)

    def lives(self, what: str) -> list[np.ndarray]:
        """Return (n, 2) time and value of a field of Usage, for each life."""
        found: dict[str, list[tuple[float, float]]] = {}
        for at, usage in zip(self.times, self.usages, strict=True):
            found.setdefault(usage.life, []).append((at, float(getattr(usage, what))))
        return [np.array(samples) for samples in found.values()]

    def share(self, phase: str) -> float:
        """Return the processor's share in a phase: seconds per second, nan when it never ran then."""
        spent = passed = 0.0
        pairs = zip(self.times, self.usages, self.phases, strict=True)
        before = next(pairs, None)
        for now in pairs:
            assert before is not None
            if now[1].life == before[1].life and now[2] == before[2] == phase:
                spent += now[1].cpu - before[1].cpu
                passed += now[0] - before[0]
            before = now
        return spent / passed if passed else float("nan")


@dataclass
class Record:
    """What a file of the record holds."""

    about: dict[str, Any] = field(default_factory=dict)
    events: list[tuple[float, str, str]] = field(default_factory=list)
    programs: dict[str, Series] = field(default_factory=dict)
    totals: list[dict[str, Any]] = field(default_factory=list)

    @property
    def duration(self) -> float:
        """Seconds from the beginning to the last sample."""
        return self.totals[-1]["t"] if self.totals else 0.0


def read(path: Path) -> Record:
    """Return what is in the file; a last line that was cut off is left out."""
    record, phase = Record(), "start"
    for text in path.read_text().splitlines():
        try:
            line = json.loads(text)
        except json.JSONDecodeError:
            continue  # the run was killed while it wrote
        if "about" in line:
            record.about = line["about"]
        elif "event" in line:
            record.events.append((line["t"], line["event"], line["text"]))
            phase = line["text"] if line["event"] == "phase" else phase
        else:
            programs = line.pop("programs")
            record.totals.append({**line, "phase": phase, "programs": len(programs)})
            for name, values in programs.items():
                series = record.programs.setdefault(name, Series())
                series.times.append(line["t"])
                series.usages.append(Usage(*values))
                series.phases.append(phase)
    return record
