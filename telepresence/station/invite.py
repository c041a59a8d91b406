"""`./stack invite`: links by which somebody without an account sees, or drives, by the page.

    ./stack invite --drive                    one link for two hours, as text and as a QR code
    ./stack invite --watch --for 30m --once   one person, who sees and may press the red stop
    ./stack invite --list
    ./stack invite --withdraw ID

Whoever has the link comes in under a name of their own choice, ranks below everybody with an account, and is out when
the link ends or is withdrawn. See `telepresence.teleop.invitations`.
"""

from __future__ import annotations

import argparse
import getpass
import re
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from telepresence.page import qr_code
from telepresence.teleop.accounts import UserError
from telepresence.teleop.invitations import Invitation, Invitations, beside
from telepresence.teleop.lease_messages import PILOT, WATCHER

_UNITS = {"m": 60.0, "h": 3600.0, "d": 24 * 3600.0}
_WORDS = {PILOT: "drive", WATCHER: "watch"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    options = parse(sys.argv[1:] if arguments is None else arguments)
    invitations = Invitations(beside(options.users))
    try:
        if options.list:
            print(listing(invitations.all(), time.time()), end="")
        elif options.withdraw:
            invitation = invitations.withdraw(options.withdraw)
            print(f"The link {invitation.id} is withdrawn; who came in by it is out.")
        else:
            role = PILOT if options.drive else WATCHER
            invitation, link = invitations.invite(role, options.lasts, options.once, getpass.getuser())
            print(f"{qr_code.for_terminal(link)}\n\n{link}\n\n{described(invitation, time.time())}")
    except UserError as error:
        print(f"invite: {error}", file=sys.stderr)
        return 1
    return 0


def listing(found: list[Invitation], now: float) -> str:
    """Return the list of links, for people."""
    if not found:
        return "There are no links.\n"
    lines = [f"{'ID':<10}{'TO':<7}{'ENDS IN':<9}{'USED':<10}MADE BY"]
    for one in found:
        used = f"{one.used}{' of 1' if one.once else ''}"
        lines.append(f"{one.id:<10}{_WORDS[one.role]:<7}{duration(one.ends - now):<9}{used:<10}{one.maker}")
    return "\n".join(lines) + "\n"


def described(invitation: Invitation, now: float) -> str:
    """Return what a new link allows, in a sentence or two."""
    who = "One person" if invitation.once else "Whoever has it"
    what = "drives" if invitation.role == PILOT else "sees, and may press the red stop,"
    return (
        f"{who} {what} for {duration(invitation.ends - now)} from now. "
        f"Withdraw it:  ./stack invite --withdraw {invitation.id}"
    )


def duration(seconds: float) -> str:
    """Return a time as people say it."""
    minutes = max(1, round(seconds / 60.0))
    hours, minutes = divmod(minutes, 60)
    days, hours = divmod(hours, 24)
    parts = [(days, "d"), (hours, "h"), (minutes, "min")]
    return " ".join(f"{count} {unit}" for count, unit in parts if count)


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./stack invite", description="Make a link by which somebody without an account comes in by the page."
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--drive", action="store_true", help="whoever has the link may take a free robot, and drive")
    what.add_argument("--watch", action="store_true", help="whoever has the link sees and may press the red stop")
    what.add_argument("--list", action="store_true", help="list the valid links")
    what.add_argument("--withdraw", metavar="ID", help="end a link at once, and throw out whoever came in by it")
    parser.add_argument(
        "--for", dest="lasts", type=_seconds, default=7200.0, metavar="TIME", help="30m, 2h, 1d; default 2h"
    )
    parser.add_argument("--once", action="store_true", help="for one person only")
    parser.add_argument("--users", type=Path, metavar="FILE", help="the accounts beside which the links are kept")
    return parser.parse_args(arguments)


def _seconds(word: str) -> float:
    found = re.fullmatch(r"(\d{1,6}(?:\.\d{1,3})?)([mhd])", word)
    if found is None:
        raise argparse.ArgumentTypeError(f"{word!r} is no time; 30m, 2h and 1d are")
    return float(found[1]) * _UNITS[found[2]]


if __name__ == "__main__":
    sys.exit(main())
