"""Debian's Caddy in front of pages in this process, as a site has it: its real configuration on a free port."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import socket
import ssl
import subprocess
from pathlib import Path
from typing import Any

from page_in_process import PageInProcess
from waiting import wait_until

from telepresence.page.certificate import server_files
from telepresence.page.proxy import Proxy
from telepresence.site.caddyfile import Files, names_of
from telepresence.site.list_page import write_list
from telepresence.site.proxy import CADDY, write_caddyfile
from telepresence.site.site_file import Site, parse_site
from telepresence.site.unit import remove_socket, socket_of
from telepresence.station import processes

ROBOTS = "[robot.anna]\ntitle = 'Anna <b>'\n[robot.ben]\nkind = 'robotino'\n"


class ProxiedSite:
    """A site whose units are but their pages.

    Args:
        folder: Of its files; its path is short, as unix sockets' are.
        robots: Further lines of its file.
    """

    def __init__(self, folder: Path, port: int, robots: str) -> None:
        self.site: Site = parse_site(f"port = {port}\n{robots}", folder)
        self.folder, self.url = folder, self.site.url
        self.files = Files(*server_files(folder, names_of(self.site), "site"), folder)
        write_list(self.site, folder / "list")
        self._config = write_caddyfile(self.site, self.files)
        self.pages: dict[str, PageInProcess] = {}
        for unit in self.site.units:
            self.start_page(unit.name)
        self.log = folder / "caddy.log"
        self.start_proxy()

    def start_page(self, name: str) -> None:
        """Let a robot's page be there."""
        (unit,) = (unit for unit in self.site.units if unit.name == name)
        place = socket_of(unit, self.folder)
        remove_socket(place)
        folder = self.folder / name
        folder.mkdir(exist_ok=True)
        proxy = Proxy(self.site.page_url(unit), f"unix:{place}")
        self.pages[name] = PageInProcess(folder, ("Pepper",), proxy)

    def stop_page(self, name: str) -> None:
        """Let it be there no more."""
        self.pages.pop(name).close()

    def start_proxy(self) -> None:
        """Start Caddy, and wait until it answers."""
        with self.log.open("ab") as log:
            self.proxy = processes.start(
                [CADDY, "run", "--config", str(self._config), "--adapter", "caddyfile"],
                tied=True,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={**os.environ, "XDG_DATA_HOME": str(self.folder), "XDG_CONFIG_HOME": str(self.folder)},
            )
        wait_until(self._listens, "Caddy listens")

    def _listens(self) -> bool:
        assert self.proxy.poll() is None, self.log.read_text()
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.site.port), 1.0):
            return True
        return False

    def close(self) -> None:
        processes.end(self.proxy)
        for name in list(self.pages):
            self.stop_page(name)


class Client:
    """A program that speaks to the site; it believes this computer's authority alone."""

    def __init__(self, site: ProxiedSite) -> None:
        self._site = site
        self.context = ssl.create_default_context(cafile=str(site.folder / "authority.crt"))

    def ask(
        self, method: str, path: str, body: object = None, sender: str = "127.0.0.1", **headers: str
    ) -> tuple[http.client.HTTPResponse, bytes]:
        """Send a request; the answer, whose body is read, and the body."""
        client = http.client.HTTPSConnection(
            "localhost", self._site.site.port, context=self.context, timeout=30.0, source_address=(sender, 0)
        )
        try:
            named = {name.replace("_", "-"): value for name, value in headers.items()}
            client.request(method, path, None if body is None else json.dumps(body), named)
            answer = client.getresponse()
            return answer, answer.read()
        finally:
            client.close()

    def status(self, *arguments: Any, **more: Any) -> int:
        """Send a request; the answer's status."""
        return self.ask(*arguments, **more)[0].status
