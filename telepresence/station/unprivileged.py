"""Runs a program as another user when root starts it; whoever is not root notices nothing:

    python3 -m telepresence.station.unprivileged COMMAND ...

Nothing of the station needs root once everything is installed, and what is typed into the terminal of the operator's
window would be typed as root. The first of these that can read this checkout and has a home takes over:

    the person who called sudo (SUDO_UID); sound, display and configuration are theirs
    the owner of the checkout
    a system user of this project's own, which is made if need be: in a container everything is root's

The environment's TELEPRESENCE_AS_ROOT=1 keeps root.
"""

from __future__ import annotations

import os
import pwd
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from telepresence.station import priority

STAY = "TELEPRESENCE_AS_ROOT"
SYSTEM_USER, SYSTEM_HOME = "telepresence", "/var/lib/telepresence"
ROOT = Path(__file__).resolve().parents[2]
_DEVICES = ("audio", "video", "render", "input", "plugdev")
"""Groups whose members may use sound, cameras, graphics and gamepads."""
_FOLDERS = ("ROS_HOME", "ROS_LOG_DIR", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME", "TMPDIR")
"""Variables that name folders to write to."""
_X_SOCKETS = Path("/tmp/.X11-unix")


class OnlyRoot(RuntimeError):
    """There is no other user who could run the station; the text says what can be done."""


def must_leave_root(environment: Mapping[str, str] = os.environ) -> bool:
    """Whether this process is root's and nobody has said that it may stay so.

    Root of a user namespace with one user in it is an ordinary user, and cannot become another one."""
    if os.geteuid() != 0 or environment.get(STAY) == "1":
        return False
    return sum(int(line.split()[2]) for line in Path("/proc/self/uid_map").read_text().splitlines()) > 1


def choose_user(
    environment: Mapping[str, str] = os.environ, module: str = "telepresence.station.up"
) -> pwd.struct_passwd:
    """Return who runs the station in root's place.

    Args:
        module: What they must be able to import; this interpreter may have nothing but the standard library.
    Raises:
        OnlyRoot: Nobody can.
    """
    problems = []
    for user in _candidates(environment):
        problem = _problem(user, module)
        if problem is None:
            return user
        problems.append(problem)
    raise OnlyRoot(
        f"the station does not run as root, and nobody else can run it: {'; '.join(problems)}. Clone the project as "
        f"yourself and run ./stack up there, or let everybody read {ROOT} and the folders above it, or, if you know "
        f"what may type into the window's terminal, run:  {STAY}=1 ./stack up"
    )


def environment_for(user: pwd.struct_passwd, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment in which `user` goes on: their home and sound, and nothing that only root can write."""
    made = {name: value for name, value in environment.items() if not name.startswith("SUDO_")}
    made.update(HOME=user.pw_dir, USER=user.pw_name, LOGNAME=user.pw_name)
    if Path(user.pw_shell).name in ("", "nologin", "false"):
        made["SHELL"] = "/bin/bash"
    else:
        made["SHELL"] = user.pw_shell
    runtime = f"/run/user/{user.pw_uid}"  # where PulseAudio and PipeWire have their sockets
    made.pop("XDG_RUNTIME_DIR", None)
    if Path(runtime).is_dir():
        made["XDG_RUNTIME_DIR"] = runtime
    for name in _FOLDERS:
        if name in made and not _may(user, "test", "-w", made[name]):
            del made[name]
    cookie = Path(made.get("XAUTHORITY") or Path(pwd.getpwuid(0).pw_dir, ".Xauthority"))
    if cookie.exists() and not _may(user, "test", "-r", str(cookie)):
        made.pop("XAUTHORITY", None)  # the person's own one is in their home
        if str(user.pw_uid) != environment.get("SUDO_UID"):
            made.pop("DISPLAY", None)
    return made


def become(user: pwd.struct_passwd) -> None:
    """Let this process, which is root's, go on as the user, in their environment."""
    environment = environment_for(user, os.environ)
    print(f"Not as root but as {user.pw_name}, whose home is {user.pw_dir}.", file=sys.stderr)
    os.initgroups(user.pw_name, user.pw_gid)
    os.setresgid(user.pw_gid, user.pw_gid, user.pw_gid)
    os.setresuid(user.pw_uid, user.pw_uid, user.pw_uid)
    os.environ.clear()
    os.environ.update(environment)


def replace_by(command: list[str]) -> int:
    """Replace this process by the command, without root; return an exit code if that cannot be done."""
    environment = dict(os.environ)
    if must_leave_root():
        try:
            user = choose_user()
        except OnlyRoot as error:
            print(f"stack: {error}", file=sys.stderr)
            return 1
        environment = environment_for(user, os.environ)
        _make_x_sockets()
        print(f"Not as root but as {user.pw_name}, whose home is {user.pw_dir}.", file=sys.stderr)
        if not _may(user, "test", "-x", str(Path.cwd())):
            os.chdir(ROOT)
        command = [*_switch(user), *command]
        priority.allow()
    sys.stderr.flush()
    os.execvpe(command[0], command, environment)


def _make_x_sockets() -> None:
    """Make the folder for X servers' sockets, as the system does: an X server that is not root's cannot."""
    try:
        _X_SOCKETS.mkdir(mode=0o755)
    except FileExistsError:
        return
    _X_SOCKETS.chmod(0o1777)


def _candidates(environment: Mapping[str, str]) -> Iterator[pwd.struct_passwd]:
    for uid in (environment.get("SUDO_UID", ""), str(ROOT.stat().st_uid)):
        if uid.isdecimal() and int(uid) != 0:
            try:
                yield pwd.getpwuid(int(uid))
            except KeyError:  # the owner is a user of another machine: a folder mounted into a container
                continue
    yield _system_user()


def _system_user() -> pwd.struct_passwd:
    """Return the project's own user, and make it first if there is none.

    Raises:
        OnlyRoot: It cannot be made.
    """
    try:
        return pwd.getpwnam(SYSTEM_USER)
    except KeyError:
        known = {line.split(":")[0] for line in Path("/etc/group").read_text().splitlines()}
        groups = ",".join(group for group in _DEVICES if group in known)
        words = ["useradd", "--system", "--create-home", "--home-dir", SYSTEM_HOME, "--shell", "/bin/bash"]
        made = subprocess.run([*words, "--groups", groups, SYSTEM_USER], capture_output=True, text=True)
        if made.returncode:
            raise OnlyRoot(
                f"the station does not run as root, and its own user cannot be made: {made.stderr.strip()}"
            ) from None
        os.chmod(SYSTEM_HOME, 0o700)
        return pwd.getpwnam(SYSTEM_USER)


def _problem(user: pwd.struct_passwd, module: str) -> str | None:
    """Return why this user cannot run the station."""
    if not _may(user, "test", "-w", user.pw_dir):
        return f"{user.pw_name} has no home to write to"
    if not _may(user, sys.executable, "-c", f"import {module}"):
        return f"{user.pw_name} cannot read {ROOT}"
    return None


def _may(user: pwd.struct_passwd, *command: str) -> bool:
    """Whether a command succeeds for this user."""
    return subprocess.run([*_switch(user), *command], cwd="/", capture_output=True).returncode == 0


def _switch(user: pwd.struct_passwd) -> list[str]:
    return ["setpriv", f"--reuid={user.pw_uid}", f"--regid={user.pw_gid}", "--init-groups", "--inh-caps=-all"]


if __name__ == "__main__":
    sys.exit(replace_by(sys.argv[1:]))
