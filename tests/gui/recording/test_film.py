"""A film is played by another decoder: how many pictures, how large, at what times, and what they show."""

import av
import numpy as np
import pytest

from gui.recording.film import KEY_FRAME_EVERY, Film

START = 1.7e9
STAMPS = [START + at for at in (0.0, 0.1, 0.2, 0.45, 0.5, 1.5)]
"""A camera's times are not even."""


def picture(grey, height=48, width=64):
    return np.full((height, width, 3), grey, np.uint8)


def played(path):
    """(time [s], width, height, mean brightness) of each picture."""
    with av.open(str(path)) as film:
        assert film.streams.video[0].codec_context.name == "h264"
        return [
            (frame.time, frame.width, frame.height, float(frame.to_ndarray(format="gray").mean()))
            for frame in film.decode(video=0)
        ]


def test_every_picture_is_there_at_its_time(tmp_path):
    film = Film(tmp_path / "session.mp4")
    for index, stamp in enumerate(STAMPS):
        assert film.add(picture(40 * index), stamp)
    assert not film.add(picture(0), STAMPS[-1]), "no newer than the last one"
    film.close()
    found = played(film.path)
    assert film.pictures == len(found) == len(STAMPS)
    assert [time for time, *_ in found] == pytest.approx([stamp - START for stamp in STAMPS], abs=0.002)
    assert {(width, height) for _, width, height, _ in found} == {(64, 48)}
    assert [mean for *_, mean in found] == pytest.approx([40.0 * index for index in range(len(STAMPS))], abs=12.0)


def test_odd_sizes_grey_pictures_and_another_camera_fit_in(tmp_path):
    film = Film(tmp_path / "session.mp4")
    film.add(picture(100, 49, 65), START)
    film.add(np.full((49, 65), 100, np.uint8), START + 0.1)
    film.add(picture(100, 120, 160), START + 0.2)
    film.close()
    assert [size for _, *size, _ in played(film.path)] == [[64, 48]] * 3


def test_a_film_that_nobody_finished_can_be_played(tmp_path):
    film = Film(tmp_path / "session.mp4")
    for index in range(2 * KEY_FRAME_EVERY + 5):
        film.add(picture(index), START + 0.1 * index)
    copy = tmp_path / "copy.mp4"
    copy.write_bytes(film.path.read_bytes())  # a killed writer writes no more
    assert len(played(copy)) >= KEY_FRAME_EVERY
    film.close()


def test_without_pictures_there_is_no_file(tmp_path):
    film = Film(tmp_path / "session.mp4")
    film.close()
    assert not film.path.exists()
    with pytest.raises(ValueError, match="2x2"):
        film.add(picture(0, 1, 1), START)


def test_a_clock_that_is_set_back_does_not_end_the_film(tmp_path):
    film = Film(tmp_path / "session.mp4")
    for stamp in (START, START + 0.1, START - 3600.0, START - 3599.9):
        assert film.add(picture(100), stamp)
    film.close()
    assert [time for time, *_ in played(film.path)] == pytest.approx([0.0, 0.1, 0.2, 0.3], abs=0.002)
