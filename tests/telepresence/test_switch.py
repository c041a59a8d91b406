"""Settings that are on or off, wherever they are read."""

import pytest

from telepresence.station.pilot_page import OwnPage, pilot_page_address
from telepresence.switch import is_on, switch


@pytest.mark.parametrize(
    ("word", "on"),
    [("true", True), ("True", True), ("1", True), ("false", False), ("FALSE", False), ("0", False)],
)
def test_the_words_of_roslaunch(word, on):
    assert switch(word) is on and is_on({"gui": word}, "gui", usual=not on) is on


def test_what_nobody_has_set_is_as_usual():
    assert is_on({}, "gui") and not is_on({}, "gui", usual=False)


@pytest.mark.parametrize("word", ["yes", "no", "on", "", "2"])
@pytest.mark.parametrize("read", [pilot_page_address, lambda settings: OwnPage(settings, simulated=True)])
def test_a_page_for_which_signing_in_is_neither_on_nor_off_does_not_start(read, word):
    """The window would sign people in and the page would not."""
    with pytest.raises(RuntimeError, match=f"sign_in:={word}: true or false, not '{word}'"):
        read({"page": "127.0.0.1", "sign_in": word})
