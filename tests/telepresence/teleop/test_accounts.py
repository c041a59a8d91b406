"""Accounts: made, checked, locked, removed."""

import sqlite3
import statistics
import subprocess
import sys
import time

import pytest

from telepresence.teleop.accounts import _COST, LOCK_TIME, TRIES, UserError, Users, main

SECRET = "correct horse"


@pytest.fixture
def cheap(monkeypatch):
    """Guesses that cost little, for tests that make many."""
    monkeypatch.setitem(_COST, "n", 1 << 8)


@pytest.fixture
def users(tmp_path, cheap):
    users = Users(tmp_path / "users.db")
    users.add("anna", SECRET, "pilot", 3)
    return users


def test_the_right_password_gives_role_rank_and_key(users):
    account = users.check(" anna ", SECRET)
    assert (account.name, account.role, account.rank, len(account.key)) == ("anna", "pilot", 3, 32)
    assert account == users.find("anna")


def test_a_new_file_has_no_account_and_is_private(tmp_path):
    users = Users(tmp_path / "deep" / "users.db")
    assert users.all() == [] and users.find("admin") is None
    assert users.path.stat().st_mode & 0o077 == 0


def test_no_password_is_in_the_file(users):
    assert SECRET.encode() not in users.path.read_bytes()
    users.add("ben", SECRET, "pilot")
    assert users.find("ben").key != users.find("anna").key, "the same password, another salt"


def test_five_wrong_passwords_lock_the_name_for_a_while(users):
    texts = []
    for _ in range(TRIES):
        with pytest.raises(UserError) as refusal:
            users.check("anna", "wrong", now=1000.0)
        texts.append(str(refusal.value))
    assert "4 tries left" in texts[0] and "1 try left" in texts[3] and "locked" in texts[4]
    with pytest.raises(UserError, match="locked for 50 s"):
        users.check("anna", SECRET, now=1010.0)
    with pytest.raises(UserError, match="locked"):
        Users(users.path).check("anna", SECRET, now=1010.0)
    assert users.check("anna", SECRET, now=1000.0 + LOCK_TIME + 1.0).name == "anna"


def test_a_right_password_forgets_wrong_ones(users):
    for _ in range(3):
        for _ in range(TRIES - 1):
            with pytest.raises(UserError):
                users.check("anna", "wrong", now=1000.0)
        users.check("anna", SECRET, now=1000.0)


def test_unknown_names_are_answered_and_locked_like_known_ones(users):
    def tries(name):
        for _ in range(TRIES + 1):
            with pytest.raises(UserError) as refusal:
                users.check(name, "wrong", now=1000.0)
            yield str(refusal.value).replace(name, "NAME")

    assert list(tries("anna")) == list(tries("nobody"))


def test_unknown_names_take_as_long_as_known_ones(tmp_path):
    users = Users(tmp_path / "users.db")
    users.add("anna", SECRET, "pilot")

    def seconds(name):
        begin = time.thread_time()  # the processor's time, whatever else the machine does
        with pytest.raises(UserError):
            users.check(name, "wrong", now=time.time() + 1e6 * len(times))
        times.append(time.thread_time() - begin)
        return times[-1]

    times = []
    pairs = [(seconds("anna"), seconds("nobody")) for _ in range(7)]
    known, unknown = (statistics.median(values) for values in zip(*pairs, strict=True))
    assert min(known, unknown) > 0.02, "a guess is expensive"
    assert 0.75 < known / unknown < 1.33


@pytest.mark.parametrize(
    ("name", "password", "role", "text"),
    [
        ("", SECRET, "pilot", "1 to 64"),
        ("a\nb", SECRET, "pilot", "printable"),
        ("ben", "short", "pilot", "at least 8"),
        ("ben", "x" * 2000, "pilot", "at most"),
        ("ben", SECRET, "king", "pilot and watcher"),
    ],
)
def test_what_will_not_do_is_refused(users, name, password, role, text):
    with pytest.raises(UserError, match=text):
        users.add(name, password, role)
    assert [account.name for account in users.all()] == ["anna"]


def test_a_file_that_is_no_database_is_said(tmp_path):
    path = tmp_path / "users.db"
    path.write_bytes(b"something else, and long enough to be taken for a page" * 50)
    with pytest.raises(UserError, match="can't be used"):
        Users(path).check("anna", SECRET)


def test_an_injection_is_only_a_name(users):
    with pytest.raises(UserError):
        users.check("anna' OR '1'='1", SECRET)
    assert sqlite3.connect(users.path).execute("SELECT count(*) FROM users").fetchone() == (1,)


def test_the_command_line(tmp_path, capsys):
    file = ["--file", str(tmp_path / "users.db")]
    add = [
        sys.executable,
        "-m",
        "gui.users",
        *file,
        "add",
        "will",
        "--role",
        "watcher",
        "--password-stdin",
    ]
    subprocess.run(add, input=f"{SECRET}\n", text=True, check=True, timeout=60)
    assert main([*file, "list"]) == 0
    assert capsys.readouterr().out.split() == ["will", "watcher", "rank", "0"]
    assert Users(tmp_path / "users.db").check("will", SECRET).role == "watcher"
    assert main([*file, "remove", "will"]) == 0
    assert main([*file, "remove", "will"]) == 1
    assert "nobody called" in capsys.readouterr().err
