"""Cookies: whose they are, and how long. Times are invented."""

import pytest

from telepresence.page.sign_ins import IDLE_LIFE, LIFE, MOST, MOST_OF_ONE, SignIns
from telepresence.teleop.lease_messages import PILOT, Account

ANNA = Account("anna", PILOT)


def test_a_cookie_is_one_person_s_until_that_person_leaves():
    sign_ins = SignIns()
    cookie, sign_in = sign_ins.begin(ANNA, 0.0)
    assert sign_ins.find(cookie, 1.0) is sign_in and sign_in.account is ANNA
    assert sign_ins.find(cookie[:-1], 1.0) is None and sign_ins.find("", 1.0) is None
    sign_ins.end(cookie)
    assert sign_ins.find(cookie, 1.0) is None


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
