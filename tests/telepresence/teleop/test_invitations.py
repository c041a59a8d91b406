"""Invitations: made, used, ended, withdrawn. Times are invented; a window of a guest joins the real lease."""

import base64
import sqlite3
import string
from concurrent.futures import ThreadPoolExecutor

import pytest
from cheap_passwords import CHEAP

from telepresence.teleop import invitations as module
from telepresence.teleop.accounts import UserError, Users, is_guest_name
from telepresence.teleop.drive_lease import DriveLease
from telepresence.teleop.invitations import GUEST_RANK, InvitationError, Invitations, beside
from telepresence.teleop.key_agreement import EVERYBODY, OPEN, WindowSide, public_key
from telepresence.teleop.known_accounts import KnownAccounts
from telepresence.teleop.lease_messages import PILOT, WATCHER, Account, sign_join

LEASE = public_key(bytes(range(32)))
HOUR = 3600.0


@pytest.fixture
def invitations(tmp_path):
    return Invitations(tmp_path / "users.db.invitations")


def use(invitations, token, name="Lena", now=1.0):
    return invitations.use(token, name, LEASE, now)[0]


def test_a_link_makes_a_guest_of_whoever_has_it(invitations):
    made, token = invitations.make(PILOT, HOUR, maker="anna", now=0.0)
    guest = use(invitations, token)
    assert (guest.name, guest.role, guest.rank) == ("Lena (guest)", PILOT, GUEST_RANK)
    assert public_key(guest.credential.private) == guest.public and guest.credential.lease == LEASE
    assert invitations.guests(2.0) == {guest.name: guest}
    (found,) = invitations.all(2.0)
    assert (found.id, found.maker, found.used) == (made.id, "anna", 1)


def test_guests_never_share_a_name(invitations):
    _, token = invitations.make(WATCHER, HOUR, now=0.0)
    names = [use(invitations, token, name).name for name in ("Lena", " Lena ", "", "anna (pilot)", "L\u202ena\n" * 30)]
    assert names[:4] == ["Lena (guest)", "Lena (guest 2)", "Guest (guest)", "anna (pilot) (guest)"]
    assert all(is_guest_name(name) and name.isprintable() and len(name) <= 60 for name in names)
    invitations.leave("Lena (guest)")
    assert use(invitations, token).name == "Lena (guest)"


def test_it_ends_with_its_guests(invitations):
    _, token = invitations.make(PILOT, HOUR, now=0.0)
    use(invitations, token, now=HOUR - 1.0)
    assert len(invitations.guests(HOUR - 1.0)) == 1 and invitations.guests(HOUR + 1.0) == {}
    assert invitations.all(HOUR + 1.0) == []
    with pytest.raises(InvitationError, match="ended"):
        use(invitations, token, now=HOUR + 1.0)


def test_it_is_withdrawn_with_its_guests(invitations):
    made, token = invitations.make(PILOT, HOUR, now=0.0)
    _, other = invitations.make(WATCHER, HOUR, now=0.0)
    use(invitations, token), use(invitations, other, "Otto")
    assert invitations.withdraw(made.id).role == PILOT
    assert list(invitations.guests(1.0)) == ["Otto (guest)"]
    with pytest.raises(InvitationError, match="nothing"):
        use(invitations, token)
    with pytest.raises(InvitationError):
        invitations.withdraw(made.id)


def test_once_is_once_for_two_at_the_same_moment(invitations):
    _, token = invitations.make(PILOT, HOUR, once=True, now=0.0)

    def enter(_number):
        try:
            return use(invitations, token)
        except InvitationError:
            return None

    with ThreadPoolExecutor(4) as threads:
        assert sum(guest is not None for guest in threads.map(enter, range(8))) == 1


LETTERS = string.ascii_uppercase + string.ascii_lowercase + string.digits + "-_"
"""Letters of base64 in addresses, in the order of their value."""


def test_an_altered_link_opens_nothing(invitations):
    _, token = invitations.make(WATCHER, HOUR, now=0.0)
    changed = [token[:at] + LETTERS[LETTERS.index(token[at]) ^ 1] + token[at + 1 :] for at in range(43)]
    for wrong in (*changed, token[:-1], token + "A", token.upper(), f" {token}", "", "ä" * 43, "-" * 43, "\ud800"):
        with pytest.raises(InvitationError):
            use(invitations, wrong)
    assert invitations.guests(1.0) == {}


def test_the_file_holds_no_link_and_a_changed_row_none_either(invitations):
    made, token = invitations.make(WATCHER, HOUR, once=True, now=0.0)
    guest = use(invitations, token)
    number = base64.urlsafe_b64decode(token + "=")
    kept = invitations.path.read_bytes()
    assert not any(part in kept for part in (token.encode(), number[:16], number[16:], guest.credential.private))
    assert invitations.path.stat().st_mode & 0o777 == 0o600
    for change in ("role = 'pilot'", "ends = 1e9", "once = 0"):
        made, token = invitations.make(WATCHER, HOUR, once=True, now=0.0)
        with sqlite3.connect(invitations.path) as database:
            database.execute(f"UPDATE invitations SET {change} WHERE id = ?", (made.id,))
        with pytest.raises(InvitationError):
            use(invitations, token)


def test_links_and_guests_have_an_end_in_number(invitations, monkeypatch):
    monkeypatch.setattr(module, "MOST_INVITATIONS", 2)
    monkeypatch.setattr(module, "MOST_GUESTS", 2)
    _, token = invitations.make(PILOT, HOUR, now=0.0)
    invitations.make(PILOT, 2 * HOUR, now=0.0)
    with pytest.raises(InvitationError):
        invitations.make(PILOT, HOUR, now=1.0)
    invitations.make(PILOT, HOUR, now=HOUR + 1.0)
    use(invitations, token := invitations.make(PILOT, HOUR, now=3 * HOUR)[1], now=3 * HOUR)
    use(invitations, token, now=3 * HOUR)
    with pytest.raises(InvitationError):
        use(invitations, token, now=3 * HOUR)


@pytest.mark.parametrize(
    ("role", "lasts"), [("admin", HOUR), (PILOT, 59.0), (PILOT, 8 * 24 * HOUR), (PILOT, float("nan"))]
)
def test_what_no_invitation_can_be(invitations, role, lasts):
    with pytest.raises(InvitationError):
        invitations.make(role, lasts)


def test_nothing_is_made_by_looking(invitations):
    assert invitations.all() == [] and invitations.guests() == {} and not invitations.path.exists()
    with pytest.raises(InvitationError, match="page"):
        invitations.link("x")
    invitations.set_page("https://192.0.2.7:8443/")
    assert invitations.link("x") == "https://192.0.2.7:8443/#i=x"


def test_they_lie_beside_the_accounts_or_at_home(tmp_path, monkeypatch):
    assert beside(tmp_path / "users.db") == tmp_path / "users.db.invitations"
    monkeypatch.setattr(module.os, "access", lambda *_words: False)
    assert beside(tmp_path / "users.db").is_relative_to(module.Path.home())


def test_no_account_is_called_as_a_guest_is(tmp_path):
    with pytest.raises(UserError):
        Users(tmp_path / "users.db", CHEAP).add("Lena (guest 2)", "correct horse", PILOT)


@pytest.mark.parametrize("sign_in", [True, False])
def test_a_guest_drives_by_the_lease_and_everybody_takes_the_robot_back(tmp_path, invitations, sign_in):
    users = Users(tmp_path / "users.db", CHEAP)
    users.add("anna", "correct horse", PILOT)
    anna = users.check("anna", "correct horse") if sign_in else Account("anna", PILOT)
    known = KnownAccounts(users if sign_in else None, invitations)
    private = known.of_lease(())[0]
    assert sign_in or private == EVERYBODY
    made, token = invitations.make(PILOT, HOUR)
    guest, _ = invitations.use(token, "Lena", public_key(private))
    lease = DriveLease(known.find, private)

    def join(account, node):
        side = WindowSide(account.name, node, account.credential)
        offer = lease.offer(side.claim, 0.0)
        window = lease.prove(side.claim, offer.session, sign_join(side.session_key(offer.session, offer.key)), 0.0)
        return window, lease.admit(window, 0.0).ok if hasattr(window, "session") else False

    hers, joined = join(guest, "/lena")
    assert joined and lease._take(hers, 0.0).ok and lease.state(0.0).pilot == "Lena (guest)"
    annas, joined = join(anna, "/anna")
    assert joined and lease._take(annas, 0.0).ok and lease.state(0.0).pilot == "anna", "a guest ranks below"
    lease._take(annas, 0.0), lease._set_pilot(hers, 0.0)
    invitations.withdraw(made.id)
    lease.revise(lease.sessions(), known.of_lease(lease.names())[1], 0.1)
    assert lease.state(0.1).pilot == "" and lease.names() == {"anna"}
    assert not join(guest, "/lena")[1], "nor does the guest come back"
    assert not join(Account("Lena (guest)", PILOT, credential=OPEN), "/lena")[1], "nor anybody under that name"
