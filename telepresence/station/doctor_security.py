"""`./stack doctor --security [ADDRESS]`: what on this computer a stranger could use.

Runs on Debian's Python alone, like the rest of the doctor. Marks: ✓ as it should be; - known and cannot be reached from
outside; x to be fixed, which makes the exit status 1.
"""

from __future__ import annotations

import ipaddress
import json
import os
import re
import stat
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from telepresence.security import robot_key
from telepresence.station.doctor import ROOT, Finding, protection
from telepresence.teleop.accounts_path import default_path

JUDGED = "November 2026"
"""When the table below was last compared with its sources."""


class Library(NamedTuple):
    """A library that a wheel brings along.

    Args:
        name: As in `telepresence.station.bundled_versions`.
        oldest: The oldest versions without a known serious hole, one for each series that is looked after.
        hole: What an older one has, and where that stands.
        reached: How bytes from outside get to it; "" if they do not, and `why_not` says why.
    """

    name: str
    oldest: tuple[str, ...]
    hole: str
    reached: str = ""
    why_not: str = ""


_OPENSSL = ("3.0.21", "3.5.7", "3.6.3", "4.0.3")
_OPENSSL_HOLE = "CVE-2026-45447 and others, openssl-library.org/news/vulnerabilities"
_ONLY_JPEG = "headers are read first, and only JPEG is decoded (telepresence/video/jpeg.py)"
_ONLY_PLOTS = "only benchmarks and tests draw with it"
LIBRARIES = (
    Library("FFmpeg in PyAV", ("8.1",), "CVE-2026-40962, ffmpeg.org/security.html", "sound and pictures by WebRTC"),
    Library("libvpx in PyAV", ("1.16.0",), "CVE-2026-2447, libvpx CHANGELOG 1.16.0", "pictures by WebRTC"),
    Library("OpenSSL in cryptography", _OPENSSL, _OPENSSL_HOLE, "the handshake of WebRTC (DTLS)"),
    Library("libsrtp in pylibsrtp", ("2.1.0",), "CVE-2015-6360, libsrtp CHANGES", "every packet of WebRTC (SRTP)"),
    Library("OpenSSL in pylibsrtp", _OPENSSL, _OPENSSL_HOLE, why_not="only its AES is used, no parser of it"),
    Library("OpenCV", ("4.12.0",), "CVE-2025-53644, OpenCV issue 27271", "pictures as JPEG"),
    Library("libjpeg-turbo in OpenCV", ("2.1.91",), "CVE-2023-2804, libjpeg-turbo ChangeLog 3.0", "pictures as JPEG"),
    Library("libpng in OpenCV", ("1.6.56",), "CVE-2026-33416, libpng.org/pub/png/libpng.html", why_not=_ONLY_JPEG),
    Library("libtiff in OpenCV", ("4.7.2",), "CVE-2026-4775, libtiff release notes 4.7.2", why_not=_ONLY_JPEG),
    Library("OpenJPEG in OpenCV", ("2.5.4",), "CVE-2025-54874, OpenJPEG release notes 2.5.4", why_not=_ONLY_JPEG),
    Library("OpenEXR in OpenCV", ("2.4.1",), "CVE-2020-11758 and others, OpenEXR CHANGES", why_not=_ONLY_JPEG),
    Library(
        "FFmpeg in OpenCV",
        ("8.1",),
        "CVE-2026-40962, ffmpeg.org/security.html",
        why_not="unless com_cam is given a network camera: then whoever answers for that camera reaches it",
    ),
    Library("OpenSSL in OpenCV", _OPENSSL, _OPENSSL_HOLE, why_not="only an https:// camera of com_cam would use it"),
    Library("libjpeg-turbo in Pillow", ("2.1.91",), "CVE-2023-2804, libjpeg-turbo ChangeLog 3.0", why_not=_ONLY_PLOTS),
    Library("libtiff in Pillow", ("4.7.2",), "CVE-2026-4775, libtiff release notes 4.7.2", why_not=_ONLY_PLOTS),
    Library("libwebp in Pillow", ("1.3.2",), "CVE-2023-4863, libwebp NEWS 1.3.2", why_not=_ONLY_PLOTS),
    Library("FreeType in Pillow", ("2.13.1",), "CVE-2025-27363, FreeType CHANGES", why_not=_ONLY_PLOTS),
    Library("FreeType in Matplotlib", ("2.13.1",), "CVE-2025-27363, FreeType CHANGES", why_not=_ONLY_PLOTS),
    Library("Qt in PyQt5", ("5.15.19",), "CVE-2025-5455, wiki.qt.io/List_of_known_vulnerabilities", "texts of a robot"),
    Library(
        "libjpeg-turbo in Qt",
        ("2.1.91",),
        "CVE-2023-2804, libjpeg-turbo ChangeLog 3.0",
        why_not="the window gets pixels, not files",
    ),
)

OURS = re.compile(r"(^|/)(rosmaster|roscore|roslaunch|rosout|robot_state_publisher|joint_state_publisher|Xvfb)\b")
"""Programs that the stack starts and that do not lie in this folder."""
_LISTENING, _UNCONNECTED = "0A", "07"
"""States in /proc/net: a TCP socket that accepts, a UDP socket without a peer."""
PERSONAL = (".key", ".bag", ".active", ".mp4", ".html", ".json", ".png", ".jpg", ".csv")
"""Endings of keys and of what a recording consists of."""


def findings(address: str | None) -> Iterator[Finding]:
    """Check everything; `address` of a robot: whether there is a key for it, too."""
    yield from rights()
    yield from sockets()
    yield from protection()
    yield from files()
    yield from robots(address)
    yield from debian()
    yield from libraries()


# --- what wheels bring along -----------------------------------------------------------------------------------------


def libraries() -> Iterator[Finding]:
    """Compare the versions of bundled libraries with the oldest ones that have no known serious hole."""
    python = ROOT / ".venv/bin/python"
    try:
        script = Path(__file__).with_name("bundled_versions.py")
        answer = subprocess.run([python, script], capture_output=True, text=True, timeout=120, check=True)
        versions = json.loads(answer.stdout)
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        yield False, "libraries in the packages of .venv", f"cannot be asked: {error}; run:  ./stack build"
        return
    for library in LIBRARIES:
        if library.name not in versions:
            continue  # this machine has Debian's
        version = versions[library.name]
        wanted = f"before {', '.join(library.oldest)}: {library.hole} (as of {JUDGED})"
        if version is None:
            yield False, f"{library.name}: version unknown", "has the wheel changed? See bundled_versions.py"
        elif is_good(version, library.oldest):
            yield True, f"{library.name} {version}", ""
        elif library.reached:
            remedy = f"it gets {library.reached}; take a newer wheel into setup.py, then  ./stack lock"
            yield False, f"{library.name} {version}, {wanted}", remedy
        else:
            print(f"  - {library.name} {version}, {wanted}\n      not reached: {library.why_not}")


def is_good(version: str, oldest: tuple[str, ...]) -> bool:
    """Return whether a version is not older than the one of its series; without one, newer than all series."""
    found = _numbers(version)
    series = [_numbers(each) for each in oldest]
    same = [each for each in series if each[:2] == found[:2]]
    return found >= same[0] if same else found > max(series)


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version))


def debian() -> Iterator[Finding]:
    """Count the security updates of Debian that wait, as far as this computer knows of them."""
    try:
        command = ["apt-get", "--simulate", "--quiet", "upgrade"]
        answer = subprocess.run(command, capture_output=True, text=True, timeout=60, env={**os.environ, "LC_ALL": "C"})
    except (OSError, subprocess.SubprocessError) as error:
        yield False, "Debian's updates", f"apt-get cannot be asked: {error}"
        return
    waiting = [line.split()[1] for line in answer.stdout.splitlines() if line.startswith("Inst") and "Security" in line]
    shown = ", ".join(waiting[:5]) + (", …" if len(waiting) > 5 else "")
    what = f"Debian's security updates that wait: {len(waiting)}" + (f" ({shown})" if waiting else "")
    yield not waiting, what, "sudo apt-get update && sudo apt-get upgrade"


# --- what is exposed now ---------------------------------------------------------------------------------------------


def rights() -> Iterator[Finding]:
    yield (
        os.geteuid() != 0,
        f"this user is {'root' if os.geteuid() == 0 else 'not root'}",
        ("make a user for the robots (sudo adduser pilot), and run the stack as that one"),
    )
    rooted = sorted({name for name, _, uid in ours() if uid == 0})
    if os.geteuid() != 0:
        yield not rooted, f"programs of the stack that run as root: {', '.join(rooted) or 'none'}", "end and start them"


class Listener(NamedTuple):
    """A socket that takes what anybody sends: "tcp" or "udp", its address and port, and its number in /proc."""

    protocol: str
    address: str
    port: int
    inode: str


def sockets(proc: Path = Path("/proc")) -> Iterator[Finding]:
    """Name each socket of our programs that is open to other computers."""
    owner = {inode: name for name, pid, _ in ours(proc) for inode in _inodes(proc / str(pid))}
    found = [each for each in listeners(proc / "net") if each.inode in owner]
    if not found:
        print("  - no program of the stack listens now; ask again while one runs")
    for each in sorted(found, key=lambda each: (owner[each.inode], each.port)):
        loopback = ipaddress.ip_address(each.address).is_loopback
        yield (
            loopback,
            f"{owner[each.inode]} listens on {each.protocol} {each.address} port {each.port}",
            "everybody in the network reaches it: is it in the table of docs/security.md? Else ROS_IP=127.0.0.1",
        )


def listeners(net: Path) -> Iterator[Listener]:
    """Yield the listening sockets of a network namespace, from the files of /proc/net."""
    for name in ("tcp", "tcp6", "udp", "udp6"):
        try:
            lines = (net / name).read_text().splitlines()[1:]
        except FileNotFoundError:  # a kernel without IPv6
            continue
        for words in map(str.split, lines):
            if words[3] == (_LISTENING if name.startswith("tcp") else _UNCONNECTED):
                address, _, port = words[1].partition(":")
                yield Listener(name[:3], _address(address), int(port, 16), words[9])


def _address(text: str) -> str:
    """Return an address of /proc/net, which are words of 32 bits in this machine's own order of bytes."""
    words = b"".join(int(text[i : i + 8], 16).to_bytes(4, "little") for i in range(0, len(text), 8))
    found = ipaddress.ip_address(words)
    return str(getattr(found, "ipv4_mapped", None) or found)


def ours(proc: Path = Path("/proc")) -> Iterator[tuple[str, int, int]]:
    """Yield name, process and user of each program of the stack that may be looked at."""
    for folder in proc.iterdir():
        if not folder.name.isdigit() or folder.name == str(os.getpid()):
            continue
        try:
            # A node that roslaunch has forked shows its words as one.
            words = (folder / "cmdline").read_bytes().decode(errors="replace").replace("\0", " ").split()
            user = folder.stat().st_uid
        except OSError:  # it has ended
            continue
        if any(str(ROOT) in word for word in words[:3]) or any(OURS.search(word) for word in words[:2]):
            script = next((word for word in words[1:3] if word and not word.startswith("-")), words[0])
            yield Path(words[0] if OURS.search(words[0]) else script).name, int(folder.name), user


def _inodes(process: Path) -> Iterator[str]:
    try:
        links = [os.readlink(each) for each in (process / "fd").iterdir()]
    except OSError:  # it has ended, or is another user's
        return
    for link in links:
        if found := re.fullmatch(r"socket:\[(\d+)\]", link):
            yield found[1]


# --- files and keys --------------------------------------------------------------------------------------------------


def personal() -> Iterator[Path]:
    """Yield the files and folders that are for their owner's eyes only."""
    keys = robot_key.store_folder()
    accounts = default_path()
    recordings = Path(os.environ.get("TELEPRESENCE_FOLDER") or Path.home() / "telepresence")
    yield from accounts.parent.glob(f"{accounts.name}*")
    for folder in (keys, recordings):
        if folder.exists():
            yield folder
            yield from sorted(path for path in folder.rglob("*") if path.is_dir() or path.suffix in PERSONAL)


def files() -> Iterator[Finding]:
    """Check that keys, accounts and recordings are their owner's only."""
    wrong = []
    count = 0
    for path in personal():
        count += 1
        status = path.lstat()
        if stat.S_ISLNK(status.st_mode):
            wrong.append(f"{path} is a symbolic link: who can change what it points to has what is in it")
        elif status.st_mode & 0o077:
            wrong.append(f"chmod {'700' if stat.S_ISDIR(status.st_mode) else '600'} {path}")
        elif status.st_uid not in (0, os.geteuid()):
            wrong.append(f"{path} belongs to user {status.st_uid}")
    yield not wrong, f"keys, accounts and recordings: {count}, open to others: {len(wrong)}", "\n         ".join(wrong)


def robots(address: str | None) -> Iterator[Finding]:
    """Say which robots there is a key for; check it for one that is named or driven now."""
    keys = robot_key.paired()
    print(f"  - robots with a key here: {', '.join(keys) or 'none; a simulated robot needs none'}")
    for host in sorted({robot_key.host_of(address)} if address else driven()):
        remedy = f"a Robotino: ./stack pair {host}. Pepper has none: give it a network of its own (docs/security.md)"
        yield host in keys, f"key for {host}", remedy


def driven(proc: Path = Path("/proc")) -> set[str]:
    """Return the Robotinos, other than simulated ones, that a running launch file was given."""
    found = set()
    for _, pid, _ in ours(proc):
        try:
            text = (proc / str(pid) / "cmdline").read_bytes().decode(errors="replace")
        except OSError:  # it has ended
            continue
        found |= set(re.findall(r"robotino_ip:=([^\0:]+)", text))
    return {host.lower() for host in found if not host.startswith("127.") and host != "localhost"}
