"""Caddy, the site's proxy: its certificate, its configuration, its start."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

from telepresence.page.certificate import own_context, server_files
from telepresence.site.caddyfile import Files, caddyfile, names_of
from telepresence.site.list_page import write_list
from telepresence.site.site_file import Site, SiteError
from telepresence.site.unit import require_usable
from telepresence.station import processes

CADDY = "caddy"
JUDGING = 60.0
"""[s] for Caddy to read its configuration."""
LOOK_PERIOD = 10.0
"""[s] between two looks whether a certificate was renewed."""
RENEW_PERIOD = 86400.0
"""[s] between two looks whether one of our own is about to end."""


def prepare(site: Site, folder: Path) -> tuple[Files, Path]:
    """Write what the proxy shows and does; return its files and its configuration. Nothing runs yet.

    Args:
        folder: Of the site alone, while it runs.
    Raises:
        SiteError: There is no Caddy, or it refuses what it is to do.
        OSError: A folder cannot be written.
    """
    write_list(site, folder / "list")
    files = certificate_files(site, folder)
    return files, write_caddyfile(site, files)


def certificate_files(site: Site, folder: Path) -> Files:
    """Return the site's certificate; without one of its own, one that this computer's authority has signed.

    Raises:
        SiteError: The files are no certificate and key.
    """
    if site.certificate is not None:
        files = Files(site.certificate, site.key or site.certificate, folder)
    else:
        # Each site's own: a certificate for other names, in the same file, would be that of a site which runs.
        file = "-".join(dict.fromkeys(("site", site.host[:100], site.address)))
        made = server_files(Path.home() / ".config" / "telepresence" / "page", names_of(site), file)
        files = Files(*made, folder)
    try:
        own_context(files.certificate, files.key)
    except OSError as error:
        raise SiteError(f"{files.certificate} and {files.key} are no certificate and key: {error}") from None
    return files


class CertificateWatch:
    """Notices that the site's certificate was renewed, which Caddy reads only when it starts, and renews one that this
    computer's authority has signed.

    Args:
        now: Monotonic time [s].
    """

    def __init__(self, site: Site, files: Files, now: float) -> None:
        self._site, self._files = site, files
        self._look_due, self._renew_due = now + LOOK_PERIOD, now + RENEW_PERIOD
        self._seen, self._served = self._stamps(), self._contents()

    def renewed(self, now: float) -> bool:
        """Return whether there is another certificate than at the last call, one that can be served.

        Args:
            now: Monotonic time [s].
        """
        if now < self._look_due:
            return False
        self._look_due = now + LOOK_PERIOD
        try:
            if now >= self._renew_due:
                self._renew_due = now + RENEW_PERIOD
                certificate_files(self._site, self._files.folder)
            stamps = self._stamps()
            if stamps == self._seen:
                return False
            own_context(self._files.certificate, self._files.key)
            contents = self._contents()
        except (OSError, SiteError):  # it is just being written; else the next look finds the same
            return False
        # Who only copies or touches the files, as rsync does, has renewed nothing: another start cuts every page.
        renewed = contents != self._served
        self._seen, self._served = stamps, contents
        return renewed

    def _stamps(self) -> list[tuple[int, int]]:
        status = [file.stat() for file in (self._files.certificate, self._files.key)]
        return [(each.st_ino, each.st_mtime_ns) for each in status]

    def _contents(self) -> list[bytes]:
        files = (self._files.certificate, self._files.key)
        return [hashlib.sha256(file.read_bytes()).digest() for file in files]


def write_caddyfile(site: Site, files: Files) -> Path:
    """Write Caddy's configuration, and have Caddy read it.

    Raises:
        SiteError: There is no Caddy, it refuses it, or the folder is none for it.
    """
    if shutil.which(CADDY) is None:
        raise SiteError("there is no caddy: ./stack site installs it, or  sudo apt install caddy")
    require_usable(site, files.folder)
    path = files.folder / "Caddyfile"
    path.write_text(caddyfile(site, files), encoding="utf-8")
    words = [CADDY, "validate", "--config", str(path), "--adapter", "caddyfile"]
    environment = {**os.environ, "XDG_DATA_HOME": str(files.folder), "XDG_CONFIG_HOME": str(files.folder)}
    try:  # in a session of its own: Ctrl-C is for us, who then say and end everything in order
        answer = subprocess.run(
            words, capture_output=True, text=True, env=environment, timeout=JUDGING, start_new_session=True
        )
    except subprocess.TimeoutExpired:
        raise SiteError(f"caddy does not say within {JUDGING:g} s whether it takes the site") from None
    if answer.returncode:
        lines = (answer.stderr or answer.stdout).strip().splitlines()
        raise SiteError(f"caddy refuses the site: {lines[-1] if lines else 'it ended without a word'}")
    return path


def start_caddy(config: Path, output: BinaryIO, base: Mapping[str, str]) -> subprocess.Popen:
    """Start Caddy, which ends with this process.

    Args:
        config: Of `write_caddyfile`; Caddy's own files are beside it.
        output: Gets what it prints.
        base: Environment of whoever has started the site.
    """
    folder = str(config.parent)
    return processes.start(
        [CADDY, "run", "--config", str(config), "--adapter", "caddyfile"],
        tied=True,
        env={**base, "XDG_DATA_HOME": folder, "XDG_CONFIG_HOME": folder},
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
    )
