"""A picture of what a network that loses packets leaves of speech, for the documentation.

    python tests/bench/media/plot.py docs/concealment.png

Nothing here depends on how busy the machine is: see `rtp_replay`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[2] / "lab"))

from rtp_line import JITTER, LATE, LOSS, TEXT
from rtp_replay import likeness, pack, spoil, unpack
from sound_lab import RATE, sentence
from telepresence_1.rtp_sound import CODECS

LOSSES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2)
BEGIN = 2.0
"""Seconds until the receiver has found the sender's pace."""
WINDOW = 0.15
"""Seconds of sound in the close-up."""
COLOURS = {"l16": "#d1495b", "opus": "#00798c"}
NAMES = {"l16": "L16, silence in the holes", "opus": "Opus, rebuilt or guessed"}


def main(path: Path) -> None:
    said = np.tile(sentence(TEXT), 8)
    end = len(said) / RATE - 1.0
    packets = {codec: pack(said, codec) for codec in CODECS}
    medians: dict[str, list[float]] = {}
    heard: dict[str, np.ndarray] = {}
    for codec in CODECS:
        medians[codec] = []
        for loss in LOSSES:
            found = unpack(spoil(packets[codec], loss, JITTER), codec, LATE)
            medians[codec].append(float(np.median(likeness(said, found, BEGIN, end))))
            if loss == LOSS:
                heard[codec] = found
        print(codec, dict(zip(LOSSES, (round(value, 3) for value in medians[codec]), strict=True)))
    draw(path, medians, said, heard)


def draw(path: Path, medians: dict[str, list[float]], said: np.ndarray, heard: dict[str, np.ndarray]) -> None:
    with plt.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "savefig.dpi": 110}):
        figure, (curve, sound) = plt.subplots(1, 2, figsize=(9.0, 3.2), width_ratios=(2, 3), layout="constrained")
        for codec, values in medians.items():
            curve.plot([100 * loss for loss in LOSSES], values, "o-", color=COLOURS[codec], label=NAMES[codec])
        curve.set(xlabel="packets lost [%], 50 ms of jitter", ylabel="likeness of half a second", ylim=(0.0, 1.02))
        curve.legend(frameon=False, loc="lower left")
        begin = first_hole(said, heard["l16"]) - WINDOW / 3
        rows = [("said", said, "#333333"), *((name, heard[name], COLOURS[name]) for name in heard)]
        for row, (name, samples, colour) in enumerate(rows):
            part = cut(samples, said, begin)
            at = np.arange(len(part)) / RATE * 1e3
            sound.plot(at, 0.45 * part / np.abs(part).max() - row, color=colour, linewidth=0.8)
            sound.text(-3.0, -row, name, ha="right", va="center", color=colour)
        sound.set(xlabel=f"time around a lost packet [ms]; {100 * LOSS:.0f} % are lost", yticks=[])
        sound.set_xlim(0.0, WINDOW * 1e3)
        sound.spines["left"].set_visible(False)
        figure.savefig(path)
    print(f"written to {path}")


def cut(samples: np.ndarray, said: np.ndarray, begin: float) -> np.ndarray:
    """The close-up, shifted to where it is most like what was said: codecs and jitter buffers have delays."""
    first, count, reach = round(begin * RATE), round(WINDOW * RATE), round(0.06 * RATE)
    part = said[first : first + count]
    places = [samples[at : at + count] for at in range(first - reach, first + reach)]
    return max(places, key=lambda place: float(place @ part) / (1e-6 + float(np.linalg.norm(place))))


def first_hole(said: np.ndarray, heard: np.ndarray) -> float:
    """The first moment [s] of loud speech at which nothing is heard for 5 ms and more."""
    block = RATE // 400
    count = len(heard) // block
    quiet = np.abs(heard[: count * block]).reshape(count, block).max(axis=1) < 1e-3
    loud = np.sqrt(np.mean(said[: count * block].reshape(count, block) ** 2, axis=1))
    around = np.convolve(loud, np.ones(9) / 9, "same") > 0.12
    found = np.flatnonzero(quiet[:-1] & quiet[1:] & around[:-1])
    return float(found[found * block > BEGIN * RATE][0] * block / RATE)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
