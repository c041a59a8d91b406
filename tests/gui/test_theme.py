"""Two themes, one sheet."""

import re

import pytest

from gui import theme


@pytest.mark.parametrize("name", theme.themes())
def test_every_colour_of_the_sheet_is_known(name):
    sheet = theme.style_sheet(name)
    assert "@" not in sheet.split("*/", 1)[1]
    assert theme.colours(name)["text"] in sheet


def test_themes_name_the_same_colours():
    dark, light = (set(theme.colours(name)) for name in ("dark", "light"))
    assert dark == light


@pytest.mark.parametrize("name", theme.themes())
@pytest.mark.parametrize("ink", ["text", "soft", "quiet", "good", "warn", "bad"])
def test_words_stand_out_from_cards(name, ink):
    """WCAG 2: 4.5 to 1 for text of this size."""
    colours = theme.colours(name)
    light, dark = sorted((luminance(colours[ink]), luminance(colours["card"])), reverse=True)
    assert (light + 0.05) / (dark + 0.05) >= 4.5


def test_an_unknown_theme_names_those_that_exist():
    with pytest.raises(ValueError, match="dark, light"):
        theme.style_sheet("pink")


def test_changing_the_theme_dresses_the_application(qt):
    before = qt.styleSheet()
    try:
        theme.apply("light")
        assert theme.current() == "light"
        assert theme.colour("text").name() == theme.colours("light")["text"]
        theme.apply("dark")
        assert theme.colour("text", 0.5).alphaF() == pytest.approx(0.5, abs=0.01)
    finally:
        qt.setStyleSheet(before)
        qt.setProperty("theme", None)


def luminance(colour):
    """Relative luminance after WCAG 2."""
    parts = [int(part, 16) / 255 for part in re.findall("..", colour[1:])]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
