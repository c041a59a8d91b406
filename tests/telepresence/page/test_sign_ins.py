"""Cookies: whose they are, and how long. Times are invented."""

import json
from base64 import b64encode

import pytest

from telepresence.page.sign_ins import IDLE_LIFE, LIFE, MOST, MOST_OF_ONE, SignIns
from telepresence.teleop.key_agreement import Credential, public_key
from telepresence.teleop.lease_messages import PILOT, Account

ANNA = Account("anna", PILOT)


def test_a_cookie_is_one_person_s_until_that_person_leaves():
    sign_ins = SignIns()
    cookie, sign_in = sign_ins.begin(ANNA, 0.0)
    assert sign_ins.find(cookie, 1.0) is sign_in and sign_in.account is ANNA
    assert sign_ins.find(cookie[:-1], 1.0) is None and sign_ins.find("", 1.0) is None
    sign_ins.end(sign_in, 1.0, "The account was removed.")
    assert sign_ins.find(cookie, 1.0) is None
    assert sign_ins.why_ended(cookie) == "The account was removed." and sign_ins.why_ended("x") == ""


def test_cookies_and_names_of_browsers_are_never_the_same():
    sign_ins = SignIns()
    begun = [sign_ins.begin(Account(f"p{count}", PILOT), 0.0) for count in range(MOST)]
    assert len({cookie for cookie, _ in begun}) == len({sign_in.name for _, sign_in in begun}) == MOST
    assert all(sign_in.name not in cookie for cookie, sign_in in begun)


@pytest.mark.parametrize(("step", "lasts"), [(IDLE_LIFE - 1.0, LIFE), (IDLE_LIFE + 1.0, IDLE_LIFE)])
def test_it_ends_without_use_and_after_a_working_day(step, lasts):
    sign_ins = SignIns()
    cookie, _ = sign_ins.begin(ANNA, 0.0)
    now = 0.0
    while sign_ins.find(cookie, now) is not None:
        now += step
    assert lasts < now <= lasts + step


def test_many_sign_ins_end_the_oldest_one_of_the_same_person_first():
    sign_ins = SignIns()
    ben, _ = sign_ins.begin(Account("ben", PILOT), 0.0)
    cookies = [sign_ins.begin(ANNA, 1.0)[0] for _ in range(MOST_OF_ONE + 1)]
    assert [sign_ins.find(cookie, 2.0) is not None for cookie in cookies] == [False, *[True] * MOST_OF_ONE]
    assert sign_ins.find(ben, 2.0) is not None
    for count in range(MOST):
        sign_ins.begin(Account(f"p{count}", PILOT), 3.0)
    assert sign_ins.find(ben, 3.0) is None


def test_guests_push_out_guests_and_nobody_else():
    sign_ins = SignIns()
    ben, _ = sign_ins.begin(Account("ben", PILOT), 0.0)
    lena, _ = sign_ins.begin(Account("lena (guest)", PILOT), 1.0)
    for count in range(MOST):
        sign_ins.begin(Account(f"eve (guest {count})", PILOT), 2.0)
    assert sign_ins.find(ben, 3.0) is not None and sign_ins.find(lena, 3.0) is None


@pytest.fixture
def guest():
    private = bytes(range(32))
    return Account("lena (guest)", PILOT, -5, public_key(private), Credential(private, public_key(bytes(32))))


def test_a_restart_of_the_program_leaves_who_is_in_in(tmp_path, guest):
    file = tmp_path / "sign_ins"
    cookie, before = SignIns(file).begin(guest, 100.0)
    after = SignIns(file)
    assert after.returns(cookie) and after.all() == []
    found = after.find(cookie, 110.0)
    assert found.account == guest and found.account.credential == guest.credential
    assert (found.name, found.began) == (before.name, before.began) and not after.returns(cookie)
    after.end(found, 120.0)
    assert SignIns(file).find(cookie, 130.0) is None


def test_the_file_opens_nothing(tmp_path, guest):
    file = tmp_path / "sign_ins"
    cookie, _ = SignIns(file).begin(guest, 100.0)
    kept = file.read_bytes()
    assert file.stat().st_mode & 0o777 == 0o600
    secrets = (guest.credential.private, cookie.encode())
    forms = [form for secret in secrets for form in (secret, secret.hex().encode(), b64encode(secret))]
    assert not any(form in kept for form in (*forms, b"lena"))
    assert SignIns(file).find(json.loads(kept)[0][0], 100.0) is None, "the hash of a cookie is no cookie"
    ben, _ = SignIns(tmp_path / "other").begin(Account("ben", PILOT), 100.0)
    rows = json.loads(kept) + json.loads((tmp_path / "other").read_bytes())
    rows[0][1], rows[1][1] = rows[1][1], rows[0][1]
    file.write_text(json.dumps(rows))
    assert SignIns(file).find(cookie, 100.0) is None and SignIns(file).find(ben, 100.0) is None, "they were exchanged"


@pytest.mark.parametrize(
    "kept", ["", "[]", "null", '[["a"]]', '[["", "", 1, 2]]', "[[1, 2, 3, 4]]", pytest.param("[" * 9000, id="deep")]
)
def test_a_file_that_is_none_lets_nobody_in(tmp_path, kept):
    (tmp_path / "sign_ins").write_text(kept)
    assert SignIns(tmp_path / "sign_ins").find("", 0.0) is None


def test_a_clock_that_was_set_back_makes_nothing_last_longer():
    sign_ins = SignIns()
    cookie, _ = sign_ins.begin(ANNA, 10 * LIFE)
    assert sign_ins.find(cookie, 5 * LIFE) is None


def test_who_is_still_there_is_saved_now_and_then(tmp_path):
    file = tmp_path / "sign_ins"
    sign_ins = SignIns(file)
    cookie, _ = sign_ins.begin(ANNA, 0.0)
    sign_ins.find(cookie, IDLE_LIFE - 1.0)
    sign_ins.save_now_and_then(IDLE_LIFE - 1.0)
    assert SignIns(file).find(cookie, IDLE_LIFE + 1.0) is not None
