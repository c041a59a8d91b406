"""`./stack pair ROBOT`: put a robot's key into this pilot's store; list and forget keys.

    ./stack pair 192.168.0.1                          type or paste the key; it is not shown
    ./stack pair 192.168.0.1 --file robot.key         from a file: robot.key of the robot's bundle
    ssh ROBOT cat robot.key | ./stack pair 192.168.0.1
    ./stack pair --list
    ./stack pair --forget 192.168.0.1

make_bundle.py or, for Pepper, make_drive_server.py makes the key and shows it once (docs/robotino.md,
docs/pepper.md). Root goes on as the user who would run the station: the key is for that user's programs. Standard
library only.
"""

from __future__ import annotations

import argparse
import getpass
import pwd
import sys
from collections.abc import Sequence
from pathlib import Path

from telepresence.security import robot_key
from telepresence.security.robot_key import MOST_TEXT, RobotKey
from telepresence.station.unprivileged import OnlyRoot, become, choose_user, must_leave_root


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    options = parse(sys.argv[1:] if arguments is None else arguments)
    try:
        user = choose_user(module="telepresence.station.pair") if must_leave_root() else None
        key = None
        if user is not None:
            if options.file is not None and not _belongs_to(options.file, user):
                key = read_key(options.robot, options.file)  # root's own
            become(user)
        if options.list:
            print(listing(), end="")
        elif options.forget:
            print(forget(options.robot))
        else:
            print(pair(options.robot, key or read_key(options.robot, options.file)))
    except (OSError, ValueError, OnlyRoot) as error:
        print(f"pair: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\npair: nothing was changed", file=sys.stderr)
        return 130
    return 0


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="./stack pair",
        description="Give this computer a robot's key: without it the robot neither drives nor shows anything.",
        epilog="The key is made with the robot's bundle, in its file robot.key: docs/robotino.md, docs/pepper.md.",
    )
    parser.add_argument("robot", nargs="?", help="its address, as in robotino_ip:=ADDRESS, drive_server:=ADDRESS")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--file", type=Path, help="read the key from this file (default: typed, or standard input)")
    source.add_argument("--list", action="store_true", help="the robots whose keys are here, with fingerprints")
    source.add_argument("--forget", action="store_true", help="delete the robot's key from this computer")
    options = parser.parse_args(arguments)
    if options.list is (options.robot is not None):
        parser.error(
            "--list takes no address" if options.list else "which robot? For example: ./stack pair 192.168.0.1"
        )
    return options


def read_key(robot: str, file: Path | None) -> RobotKey:
    """Return the key from a file, from whoever types it, or from standard input."""
    robot_key.host_of(robot)
    if file is not None:
        return RobotKey.read(file)
    if sys.stdin.isatty():
        return RobotKey.parse(getpass.getpass(f"Key of the robot at {robot} (64 digits, not shown): "))
    return RobotKey.parse(sys.stdin.read(MOST_TEXT))


def _belongs_to(file: Path, user: pwd.struct_passwd) -> bool:
    try:
        return file.lstat().st_uid == user.pw_uid
    except OSError:
        return False


def pair(robot: str, key: RobotKey) -> str:
    """Store the key; what to say about it."""
    host = robot_key.host_of(robot)
    try:
        before = RobotKey.of(robot)
    except ValueError:  # what cannot be used is replaced
        before = None
    path = key.store(robot)
    if before == key:
        return f"This computer has that key of {host} already ({key.fingerprint})."
    replaced = f" in place of {before.fingerprint}" if before else ""
    return f"This computer has the key of {host} now: {key.fingerprint}{replaced}, in {path}."


def forget(robot: str) -> str:
    """Delete the key; what to say about it.

    Raises:
        ValueError: There is none.
    """
    host = robot_key.host_of(robot)
    try:
        robot_key.path_of(robot).unlink()
    except FileNotFoundError:
        raise ValueError(f"this computer has no key of {host}; see  ./stack pair --list") from None
    return (
        f"The key of {host} is deleted here. Whoever else has it still drives: only a new one in the bundle ends that."
    )


def listing() -> str:
    """Return a line for each key in the store."""
    lines = []
    for host, path in robot_key.paired().items():
        try:
            about = RobotKey.read(path).fingerprint
        except (OSError, ValueError) as error:
            about = f"cannot be used: {error}"
        lines.append(f"{host:<24} {about}\n")
    return "".join(lines) or "This computer has no robot's key. See  ./stack pair --help\n"


if __name__ == "__main__":
    sys.exit(main())
