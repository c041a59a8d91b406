"""The language of conditions: values, precedence, operators of time on a clock of the test's own."""

import pytest

from pepper_sim.naoqi.expressions import parse
from pepper_sim.naoqi.service import ServiceError


class World:
    """Keys and a clock."""

    def __init__(self):
        self.now, self.keys, self.counts = 0.0, {"one": 1, "list": [1, 2, 3], "name": "Salt"}, {}

    def key(self, name):
        return self.keys.get(name)

    def raised(self, name):
        return self.counts.get(name, 0)

    def preference(self, domain, name):
        return {("d", "k"): "5"}.get((domain, name))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3 == 7", True),
        ("(1 + 2) * 3", 9),
        ("7 / 2", 3),
        ("7 / 2.0 - .5", 3.0),
        ("7 / 0", None),
        ("5 | 2 & 3", 3),
        ("-'one' < 0 && !('one' == 2)", True),
        ("'missing'", None),
        ("'missing' == 0 || 1 > 2", True),
        ("'missing' > 1", False),
        ("'name' == \"Salt\"", True),
        ("'list'[1]", 2),
        ("'list'[9]", None),
        ("[1, 2] subsets 'list'", True),
        ("1 subsets [1, foo]", True),
        ("[4, 5] intersects 'list'", False),
        ('substr("canard", 1, 3)', "ana"),
        ('strlen(concat("coin", "s"))', 5),
        ('type(1.5) == "Float" && type(\'missing\') == "Invalid"', True),
        ('int("7") + float("0.5")', 7.5),
        ("size([1, 2, 3])", 3),
        ('int(pref("d", "k")) == 5', True),
        ('pref("d", "none")', None),
        ("ALMotion.FooSignal", None),
        ("rand(3, 3, 0)", 3),
    ],
)
def test_a_value(text, value):
    found = parse(text)(World())
    assert (found, type(found)) == (value, type(value))


@pytest.mark.parametrize(
    "text", ["", "1 +", "(1", "1 ~ 'one'", "nothing(1)", "bang(1)", "1 2", "$", "(" * 500, "!" * 9000]
)
def test_what_is_no_expression_is_refused(text):
    with pytest.raises(ServiceError):
        parse(text)


def test_operators_of_time():
    world = World()
    lasting, ago, lately, moment, stable = map(
        parse, ("'x' ~ 1.5", "('x' == 1) @ 10", "'x' # 60", "bang('x')", "stable('x')")
    )
    seen = {}
    for tick in range(601):
        world.now = tick / 8
        world.keys["x"] = int(20 <= tick < 50)
        world.counts["x"] = (tick >= 20) + (tick >= 50)
        values = [bool(node(world)) for node in (lasting, ago, lately, moment, stable)]
        seen[tick] = "".join("yn"[not value] for value in values)
    changes = {tick: text for tick, text in seen.items() if tick == 0 or seen[tick - 1] != text}
    assert changes == {
        0: "nnnny",
        20: "nnyyn",
        21: "nnyny",
        32: "ynyny",
        50: "nnyyn",
        51: "nnyny",
        100: "nyyny",
        130: "nnyny",
        530: "nnnny",
    }
