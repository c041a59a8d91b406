"""Links, invitations and sign-ins over HTTP, with real accounts; the page's program starts again on the same files."""

import asyncio
import json
from functools import partial

import pytest
from page_server import ANNA, WILL, serve

from telepresence.page import sign_in_routes
from telepresence.page.attempts import MOST
from telepresence.page.sign_ins import COOKIE
from telepresence.teleop.accounts import Try

LINK = {"role": "pilot", "hours": 2, "once": False}
GUEST = "Lena (guest)"


@pytest.fixture
def on_page(tmp_path, monkeypatch):
    monkeypatch.setattr(sign_in_routes, "REVISED", 0.02)
    return partial(serve, tmp_path)


async def invite(client, **changes):
    made = await client.fields("POST", "/invite", LINK | changes, await client.enter())
    return made, {"name": "Lena", "invitation": made["link"].rpartition("#i=")[2]}


async def until(condition):
    async with asyncio.timeout(5.0):
        while not await condition():
            await asyncio.sleep(0.02)


def test_a_link_lets_a_guest_in_until_it_is_withdrawn(on_page):
    async def scenario(client):
        made, way_in = await invite(client)
        assert made["link"].startswith("https://127.0.0.1:8443/#i=") and len(made["qr"]) == len(made["qr"][0])
        guest = await client.enter(way_in)
        me = await client.fields("GET", "/me", None, guest)
        assert me == {"name": GUEST, "role": "pilot", "robots": ["Pepper"], "invites": False}
        anna = await client.enter()
        (listed,) = (await client.fields("GET", "/invitations", None, anna))["invitations"]
        assert (listed["id"], listed["used"], listed["maker"]) == (made["id"], 1, "anna")
        assert 7190 < listed["left"] <= 7200
        assert await client.status("POST", "/withdraw", {"id": made["id"]}, anna) == 200

        async def out():
            return await client.status("GET", "/me", None, guest) == 401

        await until(out)
        assert (await client.fields("GET", "/me", None, guest))["reason"] == "Your invitation has ended."
        assert await client.status("POST", "/enter", way_in) == 403
        assert await client.status("GET", "/me", None, anna) == 200

    on_page(scenario)


def test_once_is_once_and_whoever_is_in_stays_in(on_page):
    async def scenario(client):
        _, way_in = await invite(client, once=True)
        guest = await client.enter(way_in)
        assert await client.status("POST", "/enter", way_in) == 403
        assert await client.status("GET", "/me", None, guest) == 200

    on_page(scenario)


@pytest.mark.parametrize("fields", [WILL, None])
def test_only_pilots_with_an_account_invite(on_page, fields):
    async def scenario(client):
        made, way_in = await invite(client)
        cookies = await client.enter(fields or way_in)
        for method, path, body in (
            ("POST", "/invite", LINK),
            ("GET", "/invitations", None),
            ("POST", "/withdraw", {"id": made["id"]}),
        ):
            assert await client.status(method, path, body, cookies) == 403

    on_page(scenario)


@pytest.mark.parametrize(
    "changes",
    [{"role": "admin"}, {"hours": 0}, {"hours": -1.0}, {"hours": 1e9}, {"hours": "2"}, {"hours": True}, {"once": 1}],
)
def test_what_no_invitation_can_be_is_refused(on_page, changes):
    async def scenario(client):
        assert await client.status("POST", "/invite", LINK | changes, await client.enter()) == 400

    on_page(scenario)


def test_a_restart_of_the_program_leaves_everybody_in_who_still_may_be(on_page):
    cookies = {}

    async def before(client):
        _, way_in = await invite(client)
        other, other_way_in = await invite(client, role="watcher")
        cookies.update(anna=await client.enter(), will=await client.enter(WILL))
        cookies.update(guest=await client.enter(way_in), gone=await client.enter(other_way_in))
        cookies.update(left=await client.enter())
        await client.ask("POST", "/leave", {}, cookies["left"])
        cookies["other"] = other["id"]

    on_page(before)

    async def after(client):
        client.station.users.remove("will")
        client.station.invitations.withdraw(cookies["other"])
        assert (await client.fields("GET", "/me", None, cookies["anna"]))["name"] == "anna"
        assert (await client.fields("GET", "/me", None, cookies["guest"]))["name"] == GUEST
        for name in ("will", "gone", "left"):
            assert await client.status("GET", "/me", None, cookies[name]) == 401
        changed = {COOKIE: cookies["anna"][COOKIE][:-1]}
        assert await client.status("GET", "/me", None, changed) == 401

    on_page(after)


def test_an_account_that_changes_ends_its_sign_ins(on_page):
    async def scenario(client):
        anna, will = await client.enter(), await client.enter(WILL)
        client.station.users.add("anna", "another horse", "pilot")

        async def out():
            return await client.status("GET", "/me", None, anna) == 401

        await until(out)
        assert (await client.fields("GET", "/me", None, anna))["reason"] == "Your password was changed."
        assert await client.status("GET", "/me", None, will) == 200

    on_page(scenario)


def test_tries_are_limited_and_right_ones_cost_nothing(on_page):
    async def scenario(client):
        for _ in range(3 * MOST):
            await client.enter()
        statuses = [await client.status("POST", "/enter", {"name": "x", "invitation": str(n)}) for n in range(2 * MOST)]
        assert statuses == [403] * MOST + [429] * MOST
        assert await client.status("POST", "/enter", ANNA) == 429

    on_page(scenario)


def test_where_nobody_signs_in_only_this_machine_comes_in_without_a_link(on_page):
    async def scenario(client):
        entrance = client.station.entrance
        cookies = await client.enter({"name": "Ben", "password": ""})
        assert (await client.fields("GET", "/me", None, cookies))["role"] == "pilot"
        assert await client.status("POST", "/enter", {"name": GUEST, "password": ""}) == 403
        for address in ("192.0.2.1", "2001:db8::1", "", "::ffff:192.0.2.1"):
            with pytest.raises(ValueError, match="link"):
                entrance.admit("Ben", "", address, Try())
        will = entrance.admit(WILL["name"], WILL["password"], "192.0.2.1", Try())
        assert will.role == "watcher"

    on_page(scenario, sign_in=False)


def test_the_audit_says_who_came_in_and_holds_no_secret(on_page, tmp_path):
    async def scenario(client):
        made, way_in = await invite(client)
        guest = await client.enter(way_in)
        await client.ask("POST", "/enter", ANNA | {"password": "a wrong one"})
        await client.ask("POST", "/leave", {}, guest)
        file = tmp_path / "page" / "audit.log"
        lines = [json.loads(line) for line in file.read_text().splitlines()]
        assert [line["what"] for line in lines] == [
            "came in", "invited", "came in", "refused at the entrance", "left"
        ]  # fmt: skip
        assert lines[2]["name"] == GUEST and lines[2]["invitation"] == lines[1]["invitation"] == made["id"]
        secrets = (way_in["invitation"], guest[COOKIE], ANNA["password"], "a wrong one")
        assert not any(secret in file.read_text() for secret in secrets)
        assert file.stat().st_mode & 0o777 == 0o600

    on_page(scenario)
