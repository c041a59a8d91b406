import base64

import pytest

from robotino_sim.programs import MAX_PROGRAMS, Programs
from telepresence.web.json_app import BadRequest


def program(name="circle.rvwx", data=b"<program/>"):
    return {"name": name, "size": len(data), "data": base64.b64encode(data).decode()}


@pytest.fixture
def programs():
    programs = Programs()
    programs.upload(program())
    return programs


def test_lists_what_was_uploaded(programs):
    programs.upload(program("a.b.rvwx"))
    assert programs.listing() == [
        {"id": 1, "name": "a", "old": "a", "suffix": "b.rvwx", "action": "stopped"},
        {"id": 2, "name": "circle", "old": "circle", "suffix": "rvwx", "action": "stopped"},
    ]
    assert programs.read("circle.rvwx") == b"<program/>"
    assert programs.read("square.rvwx") is None


def test_starts_stops_renames_removes(programs):
    programs.start_or_stop({"action": "stopped", "name": "circle", "suffix": "rvwx"})
    assert programs.listing()[0]["action"] == "running"
    programs.rename([{"old": "circle", "name": "round", "suffix": "rvwx"}])
    assert programs.listing()[0]["name"] == "round"
    assert programs.listing()[0]["action"] == "running"
    programs.start_or_stop({"name": "round", "suffix": "rvwx"})
    assert programs.listing()[0]["action"] == "stopped"
    programs.remove({"name": "round", "suffix": "rvwx"})
    assert programs.listing() == []


@pytest.mark.parametrize(
    "body",
    [
        {},
        [],
        {"name": "x", "size": 1, "data": "!!"},
        {"name": "x", "size": 3, "data": "AAAA AAAA"},
        {"name": "x", "size": 2, "data": "AAAA"},
        {"name": "../x", "size": 3, "data": "AAAA"},
        {"name": "", "size": 3, "data": "AAAA"},
    ],
)
def test_refuses_bad_uploads(programs, body):
    with pytest.raises(BadRequest):
        programs.upload(body)
    assert len(programs.listing()) == 1


def test_refuses_unknown_programs(programs):
    for refused in (programs.start_or_stop, programs.remove):
        with pytest.raises(BadRequest, match="no program"):
            refused({"name": "square", "suffix": "rvwx"})
    with pytest.raises(BadRequest, match="no program"):
        programs.rename([{"old": "square", "name": "x", "suffix": "rvwx"}])
    programs.upload(program("other.rvwx"))
    with pytest.raises(BadRequest, match="already"):
        programs.rename([{"old": "other", "name": "circle", "suffix": "rvwx"}])


def test_there_is_an_end_to_it(programs):
    for i in range(MAX_PROGRAMS - 1):
        programs.upload(program(f"p{i}.rvwx"))
    with pytest.raises(BadRequest, match="remove one"):
        programs.upload(program("one_more.rvwx"))
    programs.upload(program())  # replacing is no addition
