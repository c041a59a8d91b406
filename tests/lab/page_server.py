"""The pilot's page on a free port, with TLS, accounts, invitations and a robot that is but its name; its client."""

from __future__ import annotations

import asyncio
import json
import ssl
from collections.abc import Awaitable, Callable
from pathlib import Path

import aiohttp
from cheap_passwords import CHEAP

from telepresence.page.app import PilotPage
from telepresence.page.certificate import server_context
from telepresence.page.entrance import Entrance
from telepresence.page.proxy import Proxy
from telepresence.page.serving import serving
from telepresence.page.sign_ins import COOKIE
from telepresence.teleop.accounts import Users
from telepresence.teleop.invitations import Invitations, beside
from telepresence.teleop.lease_messages import PILOT, WATCHER
from telepresence.video.images import LatestImage
from telepresence.web.listener import listener, unix_listener

ANNA = {"name": "anna", "password": "correct horse"}
WILL = {"name": "will", "password": "battery staple"}


class SilentLease:
    """A drive_lease that does not answer."""

    def __init__(self, name):
        self.node_name = f"/pilot_page/{name}"

    def join(self, claim, session, proof, then):
        pass

    def send(self, session, command):
        pass


class NoConversation:
    """A robot without sound and tablet."""

    def listen(self, take):
        pass

    def speak(self, frames, rate, channels):
        raise AssertionError("nobody has the robot")

    def show_face(self, jpeg):
        raise AssertionError("nobody has the robot")

    def state(self):
        return {}


class OneRobot:
    floor = None

    def __init__(self):
        self.picture = LatestImage()
        self.conversation = NoConversation()
        self.windows: list[str] = []

    def watch(self, wanted):
        pass

    def show_who_looks(self, names):
        pass

    def lease_link(self, name):
        self.windows.append(name)
        return SilentLease(name)

    def state(self):
        return {"gate": None}


class OneStation:
    """A robot, a pilot anna, a watcher will."""

    def __init__(self, folder: Path, sign_in: bool = True) -> None:
        self.robots = {"Pepper": OneRobot()}
        self.users = Users(folder / "users.db", CHEAP)
        if not self.users.path.exists():
            self.users.add(**ANNA, role=PILOT)
            self.users.add(**WILL, role=WATCHER)
        self.entrance = Entrance(self.users, Invitations(beside(self.users.path)), sign_in)
        self.entrance.invitations.set_page("https://127.0.0.1:8443/")

    @property
    def invitations(self) -> Invitations:
        return self.entrance.invitations


class Client:
    def __init__(self, session: aiohttp.ClientSession, url: str, station: OneStation, page: PilotPage) -> None:
        self.session, self.url, self.station, self.page = session, url, station, page

    async def ask(self, method, path, body=None, cookies=None, **headers):
        data = body if isinstance(body, bytes | None) else json.dumps(body).encode()
        header = {name.replace("_", "-"): value for name, value in headers.items()}
        async with self.session.request(
            method, self.url + path, data=data, headers=header, cookies=cookies, allow_redirects=False
        ) as answer:
            return answer, await answer.read()

    async def status(self, *arguments, **more):
        return (await self.ask(*arguments, **more))[0].status

    async def enter(self, fields=ANNA):
        answer, _ = await self.ask("POST", "/enter", fields)
        return {COOKIE: answer.cookies[COOKIE].value}

    async def socket(self, cookies, attempt, page="0123456789abcdef"):
        cookie = "; ".join(f"{name}={value}" for name, value in cookies.items())
        url = f"{self.url}/ws?robot=Pepper&page={page}&attempt={attempt}"
        return await self.session.ws_connect(url, headers={"Cookie": cookie})

    async def fields(self, method, path, body=None, cookies=None):
        return json.loads((await self.ask(method, path, body, cookies))[1])


def serve(
    folder: Path, scenario: Callable[[Client], Awaitable[None]], sign_in: bool = True, proxy: Proxy | None = None
) -> None:
    """Run a scenario with a client of a page whose files are in this folder, as those of one before may be.

    Args:
        proxy: The page is behind it; with a unix socket, the client speaks as the proxy does.
    """

    async def run() -> None:
        station = OneStation(folder, sign_in)
        page = PilotPage(station, "127.0.0.1", folder=folder / "page", proxy=proxy)
        if proxy is not None and proxy.socket:
            listening, tls = unix_listener(Path(proxy.socket)), None
            connector, url = aiohttp.UnixConnector(proxy.socket), f"http://{proxy.name}"
        else:
            listening, tls = listener("127.0.0.1", 0), server_context(folder, ["127.0.0.1"])
            trust = ssl.create_default_context(cafile=str(folder / "authority.crt"))
            connector = aiohttp.TCPConnector(ssl=trust)
            url = f"https://127.0.0.1:{listening.getsockname()[1]}"
        async with (
            serving(page.application(), page.admission, listening, tls),
            aiohttp.ClientSession(connector=connector, cookie_jar=aiohttp.DummyCookieJar()) as session,
        ):
            await scenario(Client(session, url, station, page))

    asyncio.run(run())
