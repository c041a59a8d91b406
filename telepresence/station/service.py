"""`./stack service`: the unit with which systemd starts `./stack up`, and starts it again when it dies or freezes.

    ./stack service pepper gui:=false >~/.config/systemd/user/telepresence.service

Standard library only. Prints; installs nothing.
"""

from __future__ import annotations

import sys
from pathlib import Path

from telepresence.station import up

ROOT = Path(__file__).resolve().parents[2]
WATCHDOG_PERIOD = 2.0
"""Seconds without a sign of life of `./stack up` after which systemd kills it and starts it again."""
UNIT = """\
[Unit]
Description=Telepresence station: {title}
Documentation=file:{root}/docs/running.md
# However often it fails: a robot without its station only stands.
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
# So that commands overtake other programs on a busy machine (docs/faults.md).
LimitRTPRIO=5
# Every program of the station gets SIGTERM, so that each driver stops its robot, then SIGKILL.
KillMode=control-group
TimeoutStopSec=10

[Install]
WantedBy=default.target
"""


def main() -> int:
    """Print the unit for the arguments of `./stack up` on the command line; the exit code."""
    arguments = up.parse(sys.argv[1:])
    print(unit([arguments.robot, *(f"{name}:={value}" for name, value in arguments.settings.items())]), end="")
    return 0


def unit(arguments: list[str]) -> str:
    """The unit (systemd.service(5)) for these arguments of `./stack up`."""
    command = " ".join(_quoted(word) for word in (str(ROOT / "stack"), "up", *arguments))
    title = " ".join(["./stack up", *arguments]).replace("%", "%%")
    return UNIT.format(title=title, root=str(ROOT).replace("%", "%%"), command=command, watchdog=WATCHDOG_PERIOD)


def _quoted(word: str) -> str:
    """A word as ExecStart wants it: systemd expands % and $, and takes quotes away."""
    plain = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{plain}"'


if __name__ == "__main__":
    sys.exit(main())
