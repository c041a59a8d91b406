"""Accounts: made, checked, locked, removed."""

import contextlib
import sqlite3
import statistics
import subprocess
import sys
import time

import pytest
from cheap_passwords import CHEAP

from telepresence.teleop.accounts import FORGIVEN, LONGEST_PAUSE, TRIES, UserError, Users, main
from telepresence.teleop.key_agreement import public_key
from telepresence.teleop.password_key import COST, Cost, legacy_hash

SECRET = "correct horse"


@pytest.fixture
def users(tmp_path):
    users = Users(tmp_path / "users.db", CHEAP)
    users.add("anna", SECRET, "pilot", 3)
    return users


def test_the_right_password_gives_role_rank_and_key(users):
    account = users.check(" anna ", SECRET)
    assert (account.name, account.role, account.rank) == ("anna", "pilot", 3)
    assert account == users.find("anna")
    lease, accounts = users.of_lease()
    assert account.public == public_key(account.credential.private) and accounts == {"anna": account}
    assert account.credential.lease == public_key(lease)


def test_what_is_stored_is_neither_password_nor_key(users):
    private = users.check("anna", SECRET).credential.private
    stored = users.path.read_bytes()
    assert SECRET.encode() not in stored and private not in stored
    assert users.find("anna").credential.private != private
    with pytest.raises(UserError):
        users.check("anna", users.find("anna").public.hex())


def test_a_new_file_has_no_account_and_is_private(tmp_path):
    users = Users(tmp_path / "deep" / "users.db")
    assert users.all() == [] and users.find("admin") is None
    assert users.path.stat().st_mode & 0o077 == 0


def test_the_same_password_has_another_key_for_each(users):
    users.add("ben", SECRET, "pilot")
    assert users.find("ben").public != users.find("anna").public


def wrong(users, name, now, password="wrong"):
    """What a wrong try is told, and how long it waits."""
    waited = []
    with pytest.raises(UserError) as refusal:
        users.check(name, password, now=now, sleep=waited.append)
    return str(refusal.value), sum(waited)


def test_wrong_passwords_slow_further_tries_and_lock_nobody_out(users):
    tries = [wrong(users, "anna", 1000.0) for _ in range(TRIES)]
    assert "4 tries left" in tries[0][0] and "1 try left" in tries[3][0] and "waits for 1 s" in tries[4][0]
    assert all(wait == 0.0 for _, wait in tries)
    now, waits = 1000.0, []
    for _ in range(6):
        waits.append(wrong(users, "anna", now)[1])
        now += waits[-1]
    assert waits == [1.0, 2.0, 4.0, 8.0, 8.0, 8.0]
    waited = []
    assert Users(users.path, CHEAP).check("anna", SECRET, now=now, sleep=waited.append).name == "anna"
    assert waited == [LONGEST_PAUSE], "the owner waits once, whoever has tried before"
    assert users.check("anna", SECRET, now=now, sleep=pytest.fail).name == "anna", "and then no more"


def test_tries_at_one_moment_wait_one_behind_the_other(users):
    for _ in range(TRIES):
        wrong(users, "anna", 1000.0)
    assert [wrong(users, "anna", 1000.0)[1] for _ in range(4)] == [1.0, 3.0, 7.0, 15.0]
    assert "Try again in a minute" in (wrong(users, "anna", 1000.0), wrong(users, "anna", 1000.0))[1][0]


def test_wrong_passwords_are_forgotten_after_a_while_or_a_right_one(users):
    for now in (1000.0, 1000.0 + FORGIVEN + 1.0):
        for _ in range(TRIES):
            assert wrong(users, "anna", now)[1] == 0.0
    users.check("anna", SECRET, now=1000.0 + FORGIVEN + 1.0, sleep=lambda seconds: None)
    assert "4 tries left" in wrong(users, "anna", 1000.0 + FORGIVEN + 1.0)[0]


def test_a_clock_that_was_set_back_locks_nobody_out(users):
    wrong(users, "anna", 1000.0 + 3600.0)
    assert users.check("anna", SECRET, now=1000.0, sleep=pytest.fail).name == "anna"


def test_an_account_of_version_0_3_moves_when_its_person_signs_in(tmp_path):
    path = tmp_path / "users.db"
    salt = bytes(range(16))
    key = legacy_hash(SECRET, salt)
    with contextlib.closing(sqlite3.connect(path)) as old:
        old.executescript(
            "CREATE TABLE users (name TEXT PRIMARY KEY, role TEXT NOT NULL, rank INTEGER NOT NULL, salt BLOB NOT NULL,"
            " key BLOB NOT NULL);"
            "CREATE TABLE tries (name TEXT PRIMARY KEY, failed INTEGER NOT NULL, last REAL NOT NULL)"
        )
        old.execute("INSERT INTO users VALUES ('anna', 'pilot', 5, ?, ?)", (salt, key))
        old.execute("INSERT INTO users VALUES ('will', 'watcher', 0, ?, ?)", (salt, legacy_hash("another one", salt)))
        old.commit()
    users = Users(path, CHEAP)
    assert [(one.name, one.public) for one in users.all()] == [("anna", b""), ("will", b"")]
    assert users.find("anna") is None and users.of_lease()[1] == {}, "the old hash drives nothing"
    with pytest.raises(UserError):
        users.check("anna", "another one")
    account = users.check("anna", SECRET)
    assert (account.role, account.rank) == ("pilot", 5) and account == users.find("anna")
    assert account == users.check("anna", SECRET)
    assert key not in path.read_bytes(), "the old hash is gone"
    users.remove("will")
    assert [one.name for one in users.all()] == ["anna"]


def test_an_older_cost_is_raised_at_the_next_sign_in(users):
    dearer = Users(users.path, CHEAP._replace(passes=2))
    assert dearer.check("anna", SECRET).public != users.find("nobody")
    before = users.find("anna")
    assert dearer.check("anna", SECRET) == before, "once"


def test_unknown_names_are_answered_and_slowed_like_known_ones(users):
    def tries(name):
        return [wrong(users, name, 1000.0) for _ in range(TRIES + 2)]

    assert tries("anna") == tries("nobody")


def test_unknown_names_take_as_long_as_known_ones(tmp_path):
    users = Users(tmp_path / "users.db", Cost(1, 1 << 15, 1))
    users.add("anna", SECRET, "pilot")

    def seconds(name):
        begin = time.thread_time()  # the processor's time, whatever else the machine does
        wrong(users, name, time.time() + 1e6 * len(times))
        times.append(time.thread_time() - begin)
        return times[-1]

    times = []
    pairs = [(seconds("anna"), seconds("nobody")) for _ in range(7)]
    known, unknown = (statistics.median(values) for values in zip(*pairs, strict=True))
    assert 0.75 < known / unknown < 1.33


def test_a_guess_is_expensive():
    assert COST.memory * 1024 >= 19 << 20 and COST.passes >= 2, "OWASP's least for Argon2id"


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
    assert sqlite3.connect(users.path).execute("SELECT count(*) FROM accounts").fetchone() == (1,)


@pytest.mark.parametrize("option", ["--users", "--file"])
def test_the_command_line(tmp_path, capsys, option):
    """The file of the accounts is called as in the window; its former name still goes."""
    file = [option, str(tmp_path / "users.db")]
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
