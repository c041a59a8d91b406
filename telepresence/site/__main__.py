"""`./stack site`: several robots, with one address and one list. See docs/site.md.

./stack site up site.toml        brings up a unit for each robot of this computer, and the proxy in front of all
./stack site check site.toml     says what is wrong with the file, and starts nothing
"""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

from telepresence.page.certificate import fingerprint
from telepresence.security.private_files import restrict_new_files
from telepresence.site.proxy import certificate_files, write_caddyfile
from telepresence.site.site_file import Site, read_site
from telepresence.site.supervisor import banner, run
from telepresence.site.unit import require_ports
from telepresence.station import processes, start_conditions, station_folder
from telepresence.station.station_folder import StationFolder
from telepresence.station.unprivileged import STAY, must_leave_root
from telepresence.stop_signals import stop_on
from telepresence.temporary_folder import TemporaryFolder

CHECKED = "telepresence-checked-"
"""Prefix of the folder of a check: as long as the site's, whose path must have room for names of sockets."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    options = parse(sys.argv[1:] if arguments is None else arguments)
    restrict_new_files()
    try:
        site = read_site(options.file)
        return check(site) if options.command == "check" else bring_up(site)
    except (RuntimeError, OSError) as error:
        with contextlib.suppress(OSError):  # who has closed the terminal reads nothing any more
            print(f"stack site: {error}", file=sys.stderr, flush=True)
        return 1
    except KeyboardInterrupt:
        return 128 + signal.SIGINT


def check(site: Site) -> int:
    """Say what would run; the exit code. Raises RuntimeError, OSError."""
    require_ports(site)
    with TemporaryFolder(CHECKED) as folder:
        files = certificate_files(site, folder)
        write_caddyfile(site, files)
        print(banner(site, site.url, fingerprint(files.certificate)))
    print("The file is as it should be, and its ports are free.")
    return 0


def bring_up(site: Site) -> int:
    """Run the site until it is asked to end; the exit code. Raises RuntimeError, OSError."""
    if must_leave_root():
        print(
            f"stack site: not as root: run ./stack site, which becomes another user, or set {STAY}=1", file=sys.stderr
        )
        return 1
    stop = threading.Event()
    stop_on(stop, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    processes.adopt_orphans()
    for left in station_folder.sweep():
        print(f"Left by a station that was killed, and ended or removed now: {left}", file=sys.stderr)
    start_conditions.require_room()
    require_ports(site)
    folder = StationFolder()
    try:
        return run(site, folder, stop)
    finally:
        processes.end_descendants()
        folder.close()


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./stack site", description="Several robots, with one address and one list of them (docs/site.md)."
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="up|check")
    for name, text in (("up", "bring up units and proxy; Ctrl-C ends all of it"), ("check", "say what is wrong")):
        one = commands.add_parser(name, help=text, description=text)
        one.add_argument("file", type=Path, help="file of the site, TOML: docs/site.toml is one")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
