"""Bodies are read or refused with a reason; refusals and answers arrive over HTTP."""

from __future__ import annotations

import http.client
import math
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telepresence.web.json_app import (
    BadRequest,
    Environ,
    Refusal,
    Response,
    boolean,
    booleans,
    from_json,
    index,
    json_app,
    member,
    number,
    numbers,
    read_json,
    shown,
    text,
    wait_for_picture,
)
from telepresence.web.server import WebServer


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (b"", "empty"),
        (b"  \r\n", "empty"),
        (b"[0.1, 0", "not JSON"),
        (b"hello", "not JSON"),
        (b"[0.1,0,0] x", "not JSON"),
        (b"[NaN,0,0]", "NaN"),
        (b"[0,Infinity,0]", "Infinity"),
        (b"[0,0,-Infinity]", "Infinity"),
        (b"\xff\xfe[", "UTF-8"),
        (b"[" * 60_000, "nested"),
        (b"[" + b"9" * 5000 + b",0,0]", "not JSON"),
    ],
    ids=lambda value: repr(value[:12]),
)
def test_refuses_bodies_that_are_not_json(body, reason):
    with pytest.raises(BadRequest, match=reason):
        from_json(body)


@given(st.binary(max_size=200))
def test_any_body_is_read_or_refused(body):
    try:
        from_json(body)
    except BadRequest:
        pass


@pytest.mark.parametrize("value", ["1", True, None, [1], {}, math.inf, 10**400])
def test_refuses_what_is_no_finite_number(value):
    with pytest.raises(BadRequest):
        number(value, "a number")


@pytest.mark.parametrize("value", [[1, 2], [1, 2, 3, 4], "abc", {"0": 1}, [1, 2, None], 3])
def test_refuses_wrong_arrays_of_numbers(value):
    with pytest.raises(BadRequest):
        numbers(value, 3, "three numbers")


@pytest.mark.parametrize("value", [-1, 8, 0.5, "0", True])
def test_refuses_wrong_indices(value):
    with pytest.raises(BadRequest):
        index(value, 8, "an index")


def test_takes_what_is_right():
    assert numbers([1, 2.5, -3], 3, "three numbers") == (1.0, 2.5, -3.0)
    assert index(7.0, 8, "an index") == 7
    assert booleans([True, 0, 1.0], 3, "three booleans") == [True, False, True]
    assert member({"num": 3}, "num", "num") == 3
    assert text(" name ", "a name") == "name"


@pytest.mark.parametrize("value", [2, -1, 0.5, math.nan, "true", "1", None, [1]])
def test_refuses_what_is_no_boolean(value):
    with pytest.raises(BadRequest):
        boolean(value, "a boolean")


@pytest.mark.parametrize("value", [[], "x", {"val": True}])
def test_refuses_a_missing_member(value):
    with pytest.raises(BadRequest):
        member(value, "num", "num")


def test_long_values_are_cut_in_refusals():
    assert shown([1, 2]) == "[1, 2]"
    assert len(shown("x" * 1000)) == 60


def test_a_picture_is_waited_for_and_given_up():
    coming = iter([None, None, b"jpeg"])
    assert wait_for_picture(lambda: next(coming), 5.0) == b"jpeg"
    assert wait_for_picture(lambda: None, 0.03) is None


def _answer(method: str, path: str, environ: Environ) -> Response:
    if path == "/absent":
        raise Refusal(404, "there is no such thing", (("X-Hint", "look elsewhere"),))
    if method == "PUT":
        return Response(body=repr(read_json(environ, path, limit=20)).encode(), content_type="text/plain")
    return Response(body=b"{}")


@pytest.fixture(scope="module")
def connection() -> Iterator[http.client.HTTPConnection]:
    with WebServer(json_app(_answer, (("X-Robot", "one"),))) as server:
        connection = http.client.HTTPConnection(server.address, server.port, timeout=10.0)
        yield connection
        connection.close()


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "says"),
    [
        ("GET", "/state", None, 200, b"{}"),
        ("HEAD", "/state", None, 200, b""),
        ("PUT", "/state", b"[1, 2]", 200, b"[1, 2]"),
        ("PUT", "/state", b"[1, 2", 400, b"not JSON"),
        ("PUT", "/state", b" " * 21, 413, b"/state takes at most 20 bytes"),
        ("GET", "/absent", None, 404, b"there is no such thing\n"),
    ],
)
def test_answers_and_refusals_over_http(connection, method, path, body, status, says):
    connection.request(method, path, body)
    answer = connection.getresponse()
    found = answer.read()
    assert answer.status == status and says in found
    assert answer.headers["X-Robot"] == "one"
    assert answer.headers["X-Hint"] == ("look elsewhere" if path == "/absent" else None)
    assert answer.headers["Connection"] == ("close" if status == 413 else None)
    assert answer.headers["Content-Type"].startswith("application/json" if says == b"{}" or not says else "text/plain")
    assert int(answer.headers["Content-Length"]) == (2 if method == "HEAD" else len(found))


def test_a_body_shorter_than_announced_is_refused():
    environ = {"CONTENT_LENGTH": "9", "wsgi.input": _Short()}
    with pytest.raises(BadRequest, match="9 bytes were announced, 4 arrived") as caught:
        read_json(environ, "/state", 20)
    assert ("Connection", "close") in caught.value.headers


class _Short:
    def read(self, size: int) -> bytes:
        return b"[0.1"
