import pytest
from rto_teleop.keys import HeldKeys


@pytest.fixture
def keys():
    return HeldKeys()


@pytest.mark.parametrize(
    ("key", "velocity"),
    [
        ("w", (0.05, 0, 0)),
        ("s", (-0.05, 0, 0)),
        ("a", (0, 0.05, 0)),
        ("d", (0, -0.05, 0)),
        ("q", (0, 0, 0.5)),
        ("E", (0, 0, -0.5)),
    ],
)
def test_keys_of_the_guide(keys, key, velocity):
    keys.press(key, 0.0)
    assert keys.command(0.1) == velocity


def test_first_press_holds_until_the_keyboard_repeats(keys):
    keys.press("w", 0.0)
    assert keys.command(0.49) == (0.05, 0, 0)
    assert keys.command(0.51) == (0, 0, 0)
    assert keys.command(1.0) is None


def test_repeated_key_stops_soon_after_it_is_let_go(keys):
    for i in range(10):
        keys.press("w", 0.03 * i)
    assert keys.command(0.27 + 0.14) == (0.05, 0, 0)
    assert keys.command(0.27 + 0.16) == (0, 0, 0)


@pytest.mark.parametrize("key", [" ", "x", "k", "\x1b", "5"])
def test_any_other_key_stops_at_once(keys, key):
    keys.press("w", 0.0)
    keys.press(key, 0.1)
    assert keys.command(0.11) == (0, 0, 0)
    assert keys.command(1.0) is None


def test_scales(keys):
    keys.press("+", 0.0)
    keys.press("w", 0.0)
    assert keys.command(0.0).vx == pytest.approx(0.0625)
    keys.press("-", 0.0)
    assert keys.command(0.0).vx == pytest.approx(0.05)
    for _ in range(50):
        keys.press("+", 0.0)
    assert keys.command(0.0).vx == pytest.approx(0.5)


@pytest.mark.parametrize("scale", [0.0, -1.0, 11.0, float("nan")])
def test_silly_scales_are_refused(scale):
    with pytest.raises(ValueError, match="scale_linear"):
        HeldKeys(scale)
