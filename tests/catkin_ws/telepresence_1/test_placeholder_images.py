from __future__ import annotations

import numpy as np
import pytest
from telepresence_1.placeholder_images import draw_notice, draw_test_card


@pytest.mark.parametrize("size", [(640, 480), (320, 240), (1280, 720)])
def test_cards_have_the_size_asked_for(size: tuple[int, int]) -> None:
    for card in (draw_test_card(*size, 0.0), draw_notice(*size, "No camera", "Plug one in.", 0.0)):
        assert card.shape == (size[1], size[0], 3) and card.dtype == np.uint8


def test_the_test_card_moves_within_a_tenth_of_a_second() -> None:
    assert (draw_test_card(640, 480, 100.0) != draw_test_card(640, 480, 100.1)).any()


def test_the_same_moment_gives_the_same_card() -> None:
    assert (draw_test_card(640, 480, 100.0) == draw_test_card(640, 480, 100.0)).all()


def test_a_notice_shows_its_words_and_the_time() -> None:
    notice = draw_notice(640, 480, "No camera", "Plug one in.", 0.0)
    for other in (
        draw_notice(640, 480, "Camera lost", "Plug one in.", 0.0),
        draw_notice(640, 480, "No camera", "Wait.", 0.0),
        draw_notice(640, 480, "No camera", "Plug one in.", 1.0),
        draw_notice(640, 480, "No camera", "Plug one in.", 0.0, missing=False),
    ):
        assert (notice != other).any()


def test_nothing_that_matters_lies_where_the_tablet_crops() -> None:
    """A 4:3 picture that covers a 16:10 screen loses a twelfth at the top and at the foot."""
    text = "A rather long explanation of what is wrong with this camera and what can be done about it, in three lines."
    notice = draw_notice(640, 480, "Camera lost", text, 0.0).max(axis=2).astype(int)
    assert notice[40:440].max() > 200
    assert notice[:40].max() < 120 and notice[440:].max() < 120
