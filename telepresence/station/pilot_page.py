"""Where `./stack up` has the pilot's page, and the link by which the person at the terminal opens it.

The launch files have the arguments page:= and pilot_page_port:=. Where nobody signs in, the link has a key that the
page's program finds in its environment, where other users of the machine cannot read it, and without which it lets
nobody in; where people sign in and there is no account yet, it is an invitation to drive, which ends with the station.
Who has an account needs neither.
"""

from __future__ import annotations

import contextlib
import getpass
import ipaddress
import os
import socket
from collections.abc import Mapping
from pathlib import Path

from telepresence import ports
from telepresence.station.container_image import page_host
from telepresence.switch import is_on
from telepresence.teleop.accounts import UserError, Users
from telepresence.teleop.invitations import InvitationError, Invitations, beside
from telepresence.teleop.lease_messages import PILOT
from telepresence.web.page_auth import page_key

PILOT_PAGE_KEY = "TELEPRESENCE_PILOT_PAGE_KEY"
"""Environment variable with the key to the page of a station where nobody signs in."""
SITE = "TELEPRESENCE_SITE"
"""Environment variable with the address of the list of robots, where this station's is one of several: invitations lead
there."""
FIRST_LINK_LASTS = 12 * 3600.0
"""[s] for which the invitation to a new station holds."""


class OwnPage:
    """The page of a station that comes up.

    Args:
        settings: Of the launch file, as a person gave them.
        simulated: Whether the robots are.
    Raises:
        RuntimeError: See `pilot_page_address` and `page_by_proxy`; the certificate that a person names cannot be read.

    Attributes:
        address: Of this machine, where browsers find page and pictures; None for no page.
        socket: The file of the unix socket where it listens instead of its port; empty for none.
        invitation: The one that its link holds, and that ends with the station; empty for none.
    """

    def __init__(self, settings: Mapping[str, str], simulated: bool) -> None:
        self.address = pilot_page_address(settings)
        self._port = settings.get("pilot_page_port", str(ports.PILOT_PAGE))
        self._host = page_host(self.address or "", self._port)
        self._by_proxy, self.socket = page_by_proxy(settings)
        if certificate := settings.get("page_certificate"):
            from telepresence.page.certificate import names_of  # cryptography: a third of what `./stack up` would load

            try:
                names = names_of(Path(certificate))
            except (OSError, ValueError) as error:
                raise RuntimeError(f"page_certificate:={certificate}: {error}") from None
            if names:
                self._host = f"{names[0]}:{self._port}"
        self._settings = settings
        opened = settings.get("page", "true").lower() not in ("true", "false")
        self._signs_in = is_on(settings, "sign_in", usual=opened or not simulated)
        self._invitations = Invitations(beside())
        self.invitation = ""

    @property
    def url(self) -> str:
        """Where this machine finds the page, unix:FILE or https://…; empty for no page."""
        if self.address and self.socket:
            return f"unix:{self.socket}"
        return f"https://{self.address}:{self._port}/" if self.address else ""

    def open(self) -> str:
        """Return the link, which opens the page for whoever has it if there is no other way to come in."""
        if self.address is None:
            return ""
        if shown_certificate(self._settings) is not None:
            self._make_certificate()
        url = self._by_proxy or f"https://{self._host}/"
        if os.environ.get(SITE):  # which lets people in itself, by one link to all robots
            return url
        if not self._signs_in:
            os.environ[PILOT_PAGE_KEY] = page_key(PILOT_PAGE_KEY)
            return f"{url}#k={os.environ[PILOT_PAGE_KEY]}"
        os.environ.pop(PILOT_PAGE_KEY, None)
        try:
            if Users().all():
                return url
            invitation, token = self._invitations.make(PILOT, FIRST_LINK_LASTS, maker=getpass.getuser())
        except UserError:
            return url  # the page and the window say what is wrong with the accounts
        self.invitation = invitation.id
        return f"{url}#i={token}"

    def keep(self, link: str, invitation: str) -> str:
        """Go on with a page that has been opened, and return its link.

        Args:
            invitation: The one that the link holds; empty for none.
        """
        self.invitation = invitation
        return link

    def _make_certificate(self) -> None:
        """Make what the page will show, so that the person at the terminal reads its fingerprint before others come."""
        from telepresence.page.certificate import server_files

        names = {str(self.address), page_host(str(self.address), "").partition(":")[0]}  # as the page asks for it
        with contextlib.suppress(OSError):  # the page says what is wrong with its folder
            server_files(page_folder(self._settings.get("page_folder", "")), names)

    def close(self) -> None:
        """The station ends, and with it what only this run has given out."""
        if self.invitation:
            with contextlib.suppress(InvitationError):  # somebody has withdrawn it
                self._invitations.withdraw(self.invitation)


def page_folder(setting: str = "") -> Path:
    """Return the folder with the page's certificate, sign-ins and audit.

    Args:
        setting: Of a person; empty for the usual one.
    """
    return Path(setting) if setting else Path.home() / ".config/telepresence/page"


def shown_certificate(settings: Mapping[str, str]) -> Path | None:
    """Return the file of a certificate that is ours and that browsers of other machines warn of; None for no such."""
    address = settings.get("page", "true")
    if address.lower() in ("true", "false") or ipaddress.IPv4Address(address).is_loopback:
        return None
    file = page_folder(settings.get("page_folder", "")) / "page.crt"
    ours = not any(settings.get(name) for name in ("page_certificate", "page_proxy"))
    return file if ours and file.is_absolute() else None  # another folder is the one that the page starts in


def certificate_fingerprint(settings: Mapping[str, str]) -> str:
    """Return the SHA-256 of that certificate, to be compared with what a browser shows; empty where there is none."""
    file = shown_certificate(settings)
    if file is None:
        return ""
    from telepresence.page.certificate import fingerprint

    try:
        return fingerprint(file)
    except (OSError, ValueError):
        return ""


def page_by_proxy(settings: Mapping[str, str]) -> tuple[str, str]:
    """Return how browsers reach the page by a proxy, and the unix socket by which the proxy does; empty for no such.

    Raises:
        RuntimeError: These settings are no proxy.
    """
    url, place = settings.get("page_url", ""), settings.get("page_proxy", "")
    if not url and not place:
        return "", ""
    if not url or not place:
        raise RuntimeError(
            "page_url:= and page_proxy:= belong together: how browsers reach the page, and who asks for them"
        )
    from telepresence.page.proxy import Proxy  # aiohttp: most of what `./stack up` would load

    try:
        return url, Proxy(url, place).socket
    except ValueError as error:
        raise RuntimeError(f"page_url:={url} page_proxy:={place}: {error}") from None


def pilot_page_address(settings: Mapping[str, str]) -> str | None:
    """Return the address of this machine where the page is; None for no page.

    Args:
        settings: Of the launch file, as a person gave them.
    Raises:
        RuntimeError: That is no address of this machine, or whoever reaches it would drive without an account.
    """
    setting = settings.get("page", "true")
    if setting.lower() == "false":
        return None
    if setting.lower() == "true":
        return "127.0.0.1"
    if not _is_ours(setting):
        raise RuntimeError(
            f"page:={setting}: true, false, or one IPv4 address of this machine, where others find the pilot's page; "
            "ip -br address  lists them"
        )
    if not is_on(settings, "sign_in") and not ipaddress.IPv4Address(setting).is_loopback:
        raise RuntimeError(
            f"page:={setting} with sign_in:=false: everybody who reaches this computer would drive. Leave "
            "sign_in:=false away, and let people in:  ./stack exec python -m gui.users add NAME --role pilot  or  "
            "./stack invite --drive"
        )
    return setting


def _is_ours(word: str) -> bool:
    try:
        if ipaddress.IPv4Address(word).is_unspecified:
            return False
        with socket.socket() as probe:
            probe.bind((word, 0))
    except (ValueError, OSError):
        return False
    return True
