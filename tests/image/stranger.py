"""Who has only the link that a container prints: comes in by a browser outside, and sees."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from typing import Any

from container import Container, Failed, reached, wait_for
from newcomer import DESKTOP, Newcomer

COLOURS = """(() => {
  const canvas = new OffscreenCanvas(64, 48), pen = canvas.getContext("2d");
  pen.drawImage(document.getElementById("picture"), 0, 0, 64, 48);
  const { data } = pen.getImageData(0, 0, 64, 48), seen = new Set();
  for (let i = 0; i < data.length; i += 4) seen.add((data[i] >> 4) << 8 | (data[i + 1] >> 4) << 4 | data[i + 2] >> 4);
  return seen.size;
})()"""
"""How many colours the page's picture has: a grey card is none of a flat."""
LEAST_COLOURS = 30


@contextlib.contextmanager
def looked_at(container: Container, *browser: Any) -> Iterator[Newcomer]:
    """Give a browser for a container; end both. What fails meanwhile says what a person would have seen.

    Args:
        browser: What `Newcomer` takes after the size of its screen.
    Raises:
        Failed: As within.
    """
    newcomer = None
    try:
        newcomer = Newcomer(DESKTOP, *browser)
        yield newcomer
    except Failed as failed:
        raise Failed(f"{failed}\n{part_of(container, newcomer)}") from None
    finally:
        if newcomer is not None:
            newcomer.tools.close()
        container.close()


def come_in(container: Container, newcomer: Newcomer, patience: float = 300.0, link: str = "") -> float:
    """Open a link and see.

    Args:
        patience: [s] for each step.
        link: The one that the container prints unless another is given.
    Returns:
        How long after `run` there was a picture [s].
    Raises:
        Failed: There was none.
    """

    def printed() -> str:
        """a link to the page"""
        found = container.said(r"pilot's page (https://\S+)")
        return found[1] if found else ""

    wait_for(lambda: link or printed(), patience)
    wait_for(lambda: reached(container.port), patience)
    print(f"  - the page is there after {time.monotonic() - container.started:.1f} s", flush=True)
    newcomer.tap(link or printed())
    wait_for(newcomer.asks, patience)
    newcomer.evaluate("document.querySelector('[name=name]').value = 'anna'; "
                      "document.querySelector('#enterForm button').click()")  # fmt: skip
    wait_for(lambda: newcomer.first_picture() is not None and newcomer.evaluate(COLOURS) > LEAST_COLOURS, patience)
    return time.monotonic() - container.started


def part_of(container: Container, newcomer: Newcomer | None) -> str:
    """What a person would look at when it does not work."""
    seen = newcomer.evaluate("document.body.innerText") if newcomer is not None else ""
    return "".join(container.lines[-30:]) + f"\nThe page says:\n{seen}"
