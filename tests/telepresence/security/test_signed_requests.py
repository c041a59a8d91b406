from __future__ import annotations

import pytest

from telepresence.security.robot_key import RobotKey
from telepresence.security.signed_requests import (
    LIFETIME,
    MAX_HEADER,
    Answer,
    Challenges,
    Request,
    answer_proof,
    answer_proven,
    ask_for_proof,
    authorization,
    challenge_in,
    credentials_in,
    proven,
)

KEY, OTHER = RobotKey(bytes(32)), RobotKey(bytes([1]) * 32)
REQUEST = Request("POST", "/camera", "application/sdp", b"v=0")
ANSWER = Answer(201, "/camera/0a", "application/sdp", b"v=0 answer")


def test_a_challenge_is_good_once_and_for_a_while() -> None:
    challenges = Challenges()
    first, second = challenges.new(100.0), challenges.new(100.0)
    assert first != second and challenge_in(ask_for_proof(first)) == first
    assert challenges.fresh(first, 100.0) and challenges.use(first, 101.0)
    assert not challenges.fresh(first, 101.0) and not challenges.use(first, 101.0)
    assert challenges.fresh(second, 100.0 + LIFETIME - 0.01) and not challenges.fresh(second, 100.01 + LIFETIME)
    assert not challenges.fresh(second, 99.0), "from before this start"
    assert not Challenges().fresh(second, 100.0), "of another service"
    assert not challenges.fresh(second[:-1] + ("0" if second[-1] != "0" else "1"), 100.0)


def test_a_proof_is_of_one_request_and_one_key() -> None:
    header, proof = authorization(KEY, REQUEST, "ab")
    found = credentials_in(header)
    assert found is not None and found.proof == proof and proven(KEY, REQUEST, found)
    assert not proven(OTHER, REQUEST, found)
    for other in ({"method": "DELETE"}, {"path": "/sound"}, {"content_type": ""}, {"body": b"v=1"}):
        assert not proven(KEY, REQUEST._replace(**other), found)
    assert not proven(KEY, REQUEST, found._replace(challenge="ac"))
    assert not proven(KEY, REQUEST, found._replace(nonce="00"))
    assert authorization(KEY, REQUEST, "ab")[0] != header, "the pilot's part is new each time"


def test_an_answer_is_to_one_request() -> None:
    header = answer_proof(KEY, b"request", ANSWER)
    assert answer_proven(KEY, b"request", ANSWER, header)
    assert not answer_proven(OTHER, b"request", ANSWER, header)
    assert not answer_proven(KEY, b"another", ANSWER, header)
    for other in ({"status": 200}, {"location": "/camera/1"}, {"body": b""}):
        assert not answer_proven(KEY, b"request", ANSWER._replace(**other), header)


@pytest.mark.parametrize(
    "header",
    [
        "",
        "Basic YTpi",
        "Robot-Key",
        'Robot-Key challenge="a", nonce="b", proof="c"',
        'Robot-Key challenge="a", nonce="b"',
        'Robot-Key challenge="é", nonce="b", proof="' + "0" * 64 + '"',
        "Robot-Key " + 'challenge="a", ' * MAX_HEADER,
    ],
)
def test_other_headers_prove_nothing(header: str) -> None:
    assert credentials_in(header) is None
    assert not answer_proven(KEY, b"", ANSWER, header)
