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


@pytest.mark.parametrize(("key", "turn"), [("q", -0.05), ("e", 0.05)])
def test_turning_keys_as_in_the_guides_window(key, turn):
    keys = HeldKeys(layout="guide")
    keys.press(key, 0.0)
    assert keys.command(0.1) == (0.0, 0.0, turn)
    assert "Q     E         turn right, turn left" in keys.help() and "_keys:=usual" in keys.help()
    assert "Q     E         turn left, turn right" in HeldKeys().help() and "_keys:=guide" in HeldKeys().help()


def test_another_layout_is_refused():
    with pytest.raises(ValueError, match="usual, guide"):
        HeldKeys(layout="dvorak")


def test_two_keys_typed_in_turn_are_a_diagonal(keys):
    for i in range(6):
        keys.press("wa"[i % 2], 0.3 * i)
        assert i == 0 or keys.command(0.3 * i + 0.1) == (0.05, 0.05, 0)
    assert keys.command(1.5 + 0.51) == (0, 0, 0), "as late as after one key"


def test_the_other_way_counts_at_once(keys):
    keys.press("w", 0.0)
    keys.press("a", 0.1)
    keys.press("s", 0.2)
    assert keys.command(0.21) == (-0.05, 0.05, 0)


def test_keys_that_the_x_server_sees_held_add_up_until_they_are_let_go(keys):
    """The terminal repeats the last one only, and none when that one is let go of first."""
    keys.press("w", 0.0, held=True)
    keys.press("a", 0.1, held=True)
    for i in range(20):
        keys.observe(frozenset("wa"), 0.1 + 0.05 * i)
    assert keys.command(1.1) == (0.05, 0.05, 0)
    keys.observe(frozenset("w"), 1.15)
    assert keys.command(1.15) == (0.05, 0, 0) and keys.watched
    keys.observe(frozenset(), 1.2)
    assert keys.command(1.2) == (0, 0, 0) and not keys.watched
    keys.press("w", 1.25)
    assert keys.command(1.25 + 0.16) == (0, 0, 0), "a late repetition is no new press"
    assert keys.command(3.0) is None


def test_without_word_of_the_x_server_a_held_key_ends_as_a_repeated_one(keys):
    keys.press("w", 0.0, held=True)
    assert keys.command(0.14) == (0.05, 0, 0) and keys.command(0.16) == (0, 0, 0)


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
