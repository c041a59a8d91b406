from __future__ import annotations

import numpy as np
import pytest

from telepresence.video.draw_text import text_width, wrap, write

WHITE = (255, 255, 255)


def ink(pixels: np.ndarray) -> np.ndarray:
    """Columns and rows that hold a stroke: left, top, right, bottom."""
    rows, columns = np.nonzero(pixels.max(axis=2) > 60)
    return np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1])


def blank() -> np.ndarray:
    return np.zeros((200, 600, 3), np.uint8)


@pytest.mark.parametrize("size", [10, 24, 60])
def test_capitals_have_the_stated_height_and_place(size: int) -> None:
    picture = blank()
    write(picture, "HI", 40, 50, size, WHITE)
    left, top, right, bottom = ink(picture)
    assert abs(top - 50) <= 1 + size * 0.1 and abs(bottom - (50 + size)) <= 1 + size * 0.1
    assert abs(right - left - text_width("HI", size)) <= size * 0.4
    assert left >= 40


def test_lines_fit_the_width_and_lose_no_word() -> None:
    text = "The camera does not answer any more; plug it in again and the picture comes back by itself"
    lines = wrap(text, 14, 180)
    assert len(lines) > 3
    assert all(text_width(line, 14) <= 180 for line in lines)
    assert " ".join(lines) == text


def test_a_word_that_is_too_long_is_broken() -> None:
    lines = wrap("at http://" + "a" * 300, 12, 200)
    assert all(text_width(line, 12) <= 200 for line in lines)
    assert "".join(lines) == "athttp://" + "a" * 300


def test_the_next_line_follows_where_it_says() -> None:
    picture = blank()
    following = write(picture, "one two", 10, 20, 20, WHITE, width=80)
    assert ink(picture)[3] <= following
    assert following == 20 + 2 * 35


@pytest.mark.parametrize(("align", "left"), [(0.0, 100), (0.5, 250), (1.0, 400)])
def test_aligns(align: float, left: int) -> None:
    picture = blank()
    write(picture, "HHHHHH", 100, 50, 20, WHITE, width=400, align=align)
    assert abs(ink(picture)[0] - (100 + (400 - text_width("HHHHHH", 20)) * align)) < 6


def test_accents_become_plain_letters_and_the_rest_a_question_mark() -> None:
    with_accents, plain = blank(), blank()
    write(with_accents, "Zürich\u00a0– “äß”\n日", 10, 50, 20, WHITE)
    write(plain, 'Zurich - "a?" ?', 10, 50, 20, WHITE)
    assert (with_accents == plain).all()


@pytest.mark.parametrize("place", [(-30, -30), (580, 190), (5000, 50), (10, -500)])
def test_writing_over_the_edge_is_cut_off(place: tuple[int, int]) -> None:
    write(blank(), "Hello", *place, 40, WHITE)


def test_a_long_text_is_wrapped_quickly() -> None:
    lines = wrap("x" * 100_000, 12, 500)
    assert sum(map(len, lines)) == 100_000
