"""How large the window shows everything by itself."""

import pytest

import gui.__main__ as window


@pytest.mark.parametrize(
    ("screen", "scale"),
    [
        ((0, 0), 1.0),
        ((1280, 720), 1.0),
        ((1920, 1200), 1.0),
        ((2560, 1440), 1.25),
        ((3840, 2160), 2.0),
        ((1920, 2160), 1.0),  # two monitors, one above the other
        ((3840, 1080), 1.0),  # side by side
        ((1080, 1920), 1.0),  # upright
    ],
)
def test_it_fits_each_of_several_monitors_and_an_upright_one(monkeypatch, screen, scale):
    monkeypatch.setattr(window, "screen_size", lambda _display: screen)
    assert window.usual_scale({"DISPLAY": ":0"}) == scale
