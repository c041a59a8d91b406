"""`./stack service`: the unit with which systemd starts `./stack up`, and starts it again when it dies or freezes.

    ./stack service pepper gui:=false >~/.config/systemd/user/telepresence.service
    ./stack service unit pepper sim:=false nao_ip:=10.0.0.7      likewise ./stack unit
    ./stack service site site.toml                               likewise ./stack site up

Standard library only. Prints; installs nothing.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from telepresence.site.site_file import SiteError, read_site
from telepresence.station import up
from telepresence.station.absence import VARIABLE

_CONTROL = re.compile(r"[\x00-\x1f\x7f]")
ROOT = Path(__file__).resolve().parents[2]
WATCHDOG_PERIOD = 2.0
"""Seconds without a sign of life of `./stack up` after which systemd kills it and starts it again."""
STOP, SITE_STOP = 45.0, 20.0
"""Seconds that a station has to end, and a site of several."""
UNIT = """\
[Unit]
Description=Telepresence station: {title}
Documentation=file:{root}/docs/running.md
# However often it fails: a robot without its station only stays stopped.
StartLimitIntervalSec=0

[Service]
Type=notify
NotifyAccess=main
ExecStart={command}
# The first start installs and builds what is missing.
TimeoutStartSec=15min
WatchdogSec={watchdog:g}
# A stopped process takes no other signal.
WatchdogSignal=SIGKILL
Restart=always
RestartSec=0.1
# Short of memory, Linux kills one program, which starts again: no reason to end the others.
OOMPolicy=continue
# So that commands overtake other programs on a busy machine (docs/faults.md).
LimitRTPRIO=5
{ending}
TimeoutStopSec={stop:g}

[Install]
WantedBy=default.target
"""
STATION_ENDING = f"""\
# When ./stack up dies, its programs go on, and the next one takes them over. It ends them itself, in order.
Environment={VARIABLE}=1
KillMode=process
# Where no other one is started, nothing goes on.
ExecStopPost=/bin/sh -c 'case "$$SERVICE_RESULT" in success|timeout|exit-code) exec "$$@" ;; esac' sh {{sweep}}"""
SITE_ENDING = """\
# Every program of the site gets SIGTERM, so that each driver stops its robot, then SIGKILL.
KillMode=control-group"""


USAGE = """\
usage: ./stack service [pepper|robotino|both|fleet|walker] [name:=value ...]      a unit for ./stack up ...
       ./stack service unit [pepper|robotino|both] [name:=value ...]              for ./stack unit ...
       ./stack service site FILE                                                  for ./stack site up FILE

Prints a unit with which systemd starts this and keeps it; nothing is installed. For example:

  ./stack service pepper gui:=false >~/.config/systemd/user/telepresence.service
  systemctl --user enable --now telepresence

docs/running.md says more.
"""


def main() -> int:
    """Print the unit for the arguments of `./stack up` on the command line; the exit code."""
    words = sys.argv[1:]
    if {"-h", "--help"} & {*words}:
        print(USAGE, end="")
        return 0
    if words[:1] == ["site"]:
        return _site(words[1:])
    command = "unit" if words[:1] == ["unit"] else "up"
    arguments = up.parse(["--unit", *words[1:]] if command == "unit" else words)
    settings = [f"{name}:={value}" for name, value in arguments.settings.items()]
    return _print([arguments.robot, *settings], command)


def _site(words: list[str]) -> int:
    if len(words) != 1:
        print("usage: ./stack service site FILE", file=sys.stderr)
        return 2
    path = Path(words[0]).absolute()
    try:
        read_site(path)
    except SiteError as error:
        print(f"service: {error}", file=sys.stderr)
        return 1
    return _print([str(path)], "site up", SITE_STOP, SITE_ENDING)


def _print(*words: Any) -> int:
    """Print what `unit` returns; the exit code."""
    try:
        print(unit(*words), end="")
    except ValueError as error:
        print(f"service: {error}", file=sys.stderr)
        return 1
    return 0


def unit(arguments: list[str], command: str = "up", stop: float = STOP, ending: str = STATION_ENDING) -> str:
    """The unit (systemd.service(5)) for a command of `./stack` and its arguments.

    Args:
        stop: [s] that its programs have to end.
        ending: How they are ended.
    Raises:
        ValueError: A word has a line break or another control character, with which a unit would say something else.
    """
    for word in (str(ROOT), *arguments):
        if _CONTROL.search(word):
            raise ValueError(f"{word!r}: a unit takes no line breaks and no other control characters")
    line = _line(str(ROOT / "stack"), *command.split(), *arguments)
    title = " ".join([f"./stack {command}", *arguments]).replace("\\", "\\\\").replace("%", "%%")
    root = str(ROOT).replace("%", "%%")
    as_user = ("env", f"PYTHONPATH={ROOT}", "python3", "-P", "-m", "telepresence.station.unprivileged")
    ending = ending.format(sweep=_line(*as_user, "python3", "-P", "-m", "telepresence.station.takeover"))
    return UNIT.format(title=title, root=root, command=line, watchdog=WATCHDOG_PERIOD, stop=stop, ending=ending)


def _line(*words: str) -> str:
    """A command line."""
    return " ".join(map(_quoted, words))


def _quoted(word: str) -> str:
    """A word as ExecStart wants it: systemd expands % and $, and takes quotes away."""
    plain = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{plain}"'


if __name__ == "__main__":
    sys.exit(main())
