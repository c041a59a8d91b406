"""Argument checks and method declarations, without a wire."""

import concurrent.futures
import math

import pytest

from pepper_sim.naoqi.service import (
    Module,
    Service,
    ServiceError,
    check_argument,
    finite,
    octets,
    one_of,
    remote,
    within,
)


class _Example(Module):
    name = "ALExample"

    @remote("b(f)", "b(ff)")
    def turn(self, angle: float, speed: float = 1.0) -> bool:
        """Turns."""
        return angle * speed > 0

    @remote("v(s)", name="say")
    def say_slowly(self, text: str) -> str:
        return text

    @remote("i()")
    def fail(self) -> int:
        raise KeyError("unforeseen")

    def not_for_clients(self) -> None:
        raise AssertionError


def _binding(name, parameters):
    return next(b for b in _Example().bindings() if (b.name, b.parameters) == (name, parameters))


def test_only_declared_methods_are_offered():
    names = {binding.name for binding in _Example().bindings()}
    assert {"turn", "say", "fail", "ping", "version"} <= names
    assert "not_for_clients" not in names and "say_slowly" not in names


def test_every_overload_has_its_signature():
    found = {(b.returns, b.parameters) for b in _Example().bindings() if b.name == "turn"}
    assert found == {("b", "(f)"), ("b", "(ff)")}
    assert _binding("turn", "(f)").description == "Turns."


def test_a_declaration_with_too_few_parameters_is_an_error_at_once():
    class Wrong(Service):
        name = "Wrong"

        @remote("v(ff)")
        def move(self, x: float) -> None: ...

    with pytest.raises(TypeError, match=r"Wrong\.move"):
        list(Wrong().bindings())


def test_an_error_names_service_method_and_argument():
    with pytest.raises(ServiceError, match=r"^\tALExample::turn\n\tangle must be a finite number, got nan$"):
        _binding("turn", "(f)")(math.nan)


def test_an_unforeseen_error_is_short_for_the_client_and_logged(caplog):
    with pytest.raises(ServiceError, match=r"^\tALExample::fail\n\tinternal error"):
        _binding("fail", "()")()
    assert "unforeseen" in caplog.text and "Traceback" in caplog.text


def test_a_void_method_returns_nothing_but_a_future_is_kept():
    assert _binding("say", "(s)")("hello") is None

    class Slow(Service):
        name = "Slow"

        @remote("v()")
        def wait(self) -> concurrent.futures.Future:
            return concurrent.futures.Future()

    assert isinstance(next(Slow().bindings())(), concurrent.futures.Future)


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        ("f", 1, 1.0),
        ("f", True, 1.0),
        ("i", 3.0, 3),
        ("b", 1, True),
        ("s", "a", "a"),
        ("[f]", (1, 2.5), [1.0, 2.5]),
        ("[s]", [], []),
        ("m", None, None),
        ("r", bytearray(b"ab"), b"ab"),
    ],
)
def test_fitting_arguments_pass(kind, value, expected):
    assert check_argument(kind, value, "x") == expected


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        ("f", "1"),
        ("f", math.inf),
        ("f", None),
        ("f", 10**400),
        ("i", 1.5),
        ("i", 2**31),
        ("i", math.nan),
        ("I", -1),
        ("b", "true"),
        ("s", 1),
        ("s", b"raw"),
        ("[f]", 1.0),
        ("[f]", [1.0, "x"]),
        ("[s]", ["a", 1]),
        ("r", [1]),
    ],
)
def test_other_arguments_are_refused_by_name(kind, value):
    with pytest.raises(ServiceError, match="speed"):
        check_argument(kind, value, "speed")


def test_helpers_name_the_argument():
    assert within(0.5, 0, 1, "fraction") == 0.5
    with pytest.raises(ServiceError, match="fraction must be between 0 and 1, got 2"):
        within(2, 0, 1, "fraction")
    with pytest.raises(ServiceError, match=r"mode 'x' is unknown; known: a, b"):
        one_of("x", ("a", "b"), "mode")
    with pytest.raises(ServiceError, match="mode"):
        one_of(["a"], ("a", "b"), "mode")
    with pytest.raises(ServiceError, match="angle"):
        finite([], "angle")


def test_a_long_value_is_shortened_in_errors():
    with pytest.raises(ServiceError) as caught:
        finite("x" * 10_000, "angle")
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize("data", [b"", b"\0" * 64, bytes(range(256)), b"plain", "ü€".encode(), b'it\'s "q" \\'])
def test_bytes_arrive_whole_as_raw_data_and_as_a_string(data):
    try:
        shown = data.decode()
    except UnicodeDecodeError:
        shown = data
    for value in (data, bytearray(data), shown):
        assert bytes(octets(value, "buffer")) == data


@pytest.mark.parametrize("value", [None, 3, [1, 2], {"a": 1}])
def test_what_is_no_buffer_is_refused(value):
    with pytest.raises(ServiceError, match="buffer must be a buffer"):
        octets(value, "buffer")
