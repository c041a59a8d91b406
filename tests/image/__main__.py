"""Whether the image is what docs/container.md promises; `./stack image` has built it. Minutes, and not in `.ci/run`:

    ./stack exec python tests/image [--image NAME] [--arch arm64]

A container of it runs as a stranger's would: published ports, a read-only root file system, no capabilities, a volume
that is new. Chromium, outside, opens the printed link, sees and drives; then parts are killed, and the healthcheck must
notice; then it is asked to end. CONTAINER_TOOL names another engine than podman, CONTAINER_RUN_OPTIONS further options
of its `run`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import secrets
import shlex
import ssl
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "lab"))

from free_ports import free_port  # noqa: E402
from newcomer import DESKTOP, Newcomer  # noqa: E402

TOOL = os.environ.get("CONTAINER_TOOL", "podman")
MOST_BYTES = 900_000_000
FIRST_PICTURE_WITHIN = 20.0
"""[s] from `run`, on two cores."""
ENDS_WITHIN = 10.0
"""[s]"""
NOTICES_WITHIN = 20.0
"""[s] from a part's death until the healthcheck is red."""
TOOLS_OF_BUILDERS = "gcc g++ cc c++ cpp make cmake ld as pip pip3 pytest ruff mypy chromium Xvnc git"
PARTS = {
    "the robot": "pepper_bringup/pepper_sim",
    "its driver": "__name:=naoqi_driver",
    "the ROS master": "telepresence_ros.core",
    "the page": "__name:=pilot_page",
}
"""What the healthcheck must miss -> what stands in the command line of its program."""


COLOURS = """(() => {
  const canvas = new OffscreenCanvas(64, 48), pen = canvas.getContext("2d");
  pen.drawImage(document.getElementById("picture"), 0, 0, 64, 48);
  const { data } = pen.getImageData(0, 0, 64, 48), seen = new Set();
  for (let i = 0; i < data.length; i += 4) seen.add((data[i] >> 4) << 8 | (data[i + 1] >> 4) << 4 | data[i + 2] >> 4);
  return seen.size;
})()"""
"""How many colours the page's picture has: a grey card is none of a flat."""
LEAST_COLOURS = 30


class Failed(Exception):
    """The image does not do what it should."""


def engine(*words: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Run the engine; the caller looks at the answer."""
    return subprocess.run([TOOL, *words], capture_output=True, text=True, timeout=timeout)


wrong: list[str] = []
"""What is not as it should be."""


def say(what: str, fine: bool, figure: str = "") -> None:
    """Print one finding."""
    print(f"  {'✓' if fine else 'x'} {what}{': ' + figure if figure else ''}", flush=True)
    if not fine:
        wrong.append(what)


def wait_for(condition: Callable[[], object], timeout: float) -> float:
    """Wait until it holds; return after how many seconds. Raises Failed."""
    begin = time.monotonic()
    while not condition():
        if time.monotonic() - begin > timeout:
            raise Failed(f"not within {timeout:.0f} s: {(condition.__doc__ or condition.__name__).strip()}")
        time.sleep(0.1)
    return time.monotonic() - begin


class Container:
    """A running image.

    Args:
        image, arch: Which.
        words: What follows the image's name: arguments of `./stack`.
    """

    def __init__(self, image: str, arch: str, *words: str) -> None:
        self.name = f"telepresence-test-{secrets.token_hex(4)}"
        self.port = free_port()
        options = [
            "--name", self.name, "--hostname", "telepresence", "--platform", f"linux/{arch}", "--pull", "never",
            "--read-only", "--cap-drop", "all", "--security-opt", "no-new-privileges",
            "--volume", f"{self.name}:/var/lib/telepresence",
            "--publish", f"127.0.0.1:{self.port}:8443", "--env", f"TELEPRESENCE_PAGE_HOST=localhost:{self.port}",
        ]  # fmt: skip
        if "docker" in TOOL:  # podman gives a read-only container a /tmp by itself
            options += ["--tmpfs", "/tmp"]
        options += shlex.split(os.environ.get("CONTAINER_RUN_OPTIONS", ""))
        self.lines: list[str] = []
        self.started = time.monotonic()
        self._run = subprocess.Popen(
            [TOOL, "run", *options, image, *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._run.stdout is not None
        for line in self._run.stdout:
            self.lines.append(line)

    @property
    def code(self) -> int | None:
        """How it ended; None while it runs."""
        return self._run.poll()

    def said(self, pattern: str) -> re.Match[str] | None:
        """Return where this stands in what it has printed. Raises Failed when it has ended without."""
        found = re.search(pattern, "".join(self.lines))
        if not found and self.code is not None:
            raise Failed("the container ended:\n" + "".join(self.lines[-40:]))
        return found

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a program in it."""
        return engine("exec", self.name, *words)

    def ros(self, *words: str) -> str:
        return self.run("/opt/telepresence/stack", "exec", *words).stdout

    def healthy(self) -> bool:
        """Whether its healthcheck is green: what the engine runs every few seconds, run now."""
        return self.health().returncode == 0

    def health(self) -> subprocess.CompletedProcess[str]:
        return self.run("python3", "-m", "telepresence.station.health")

    def kill(self, part: str, with_signal: str) -> None:
        """Send a signal to the program whose command line has `part`."""
        code = (
            "import os, signal, sys; from pathlib import Path\n"
            "for file in Path('/proc').glob('[0-9]*/cmdline'):\n"
            "    if sys.argv[1].encode() in file.read_bytes() and int(file.parent.name) != os.getpid():\n"
            "        os.kill(int(file.parent.name), getattr(signal, sys.argv[2]))\n"
            "        print(file.parent.name)\n"
        )
        if not self.run("python3", "-c", code, part, with_signal).stdout.strip():
            raise Failed(f"{part} does not run")

    def close(self) -> None:
        """Remove it with its volume."""
        engine("rm", "--force", "--volumes", self.name)
        engine("volume", "rm", self.name)
        self._run.wait(timeout=20.0)
        self._reader.join(timeout=5.0)


def check_image(image: str, arch: str) -> None:
    """Look at the image without running the station."""
    (facts,) = json.loads(engine("image", "inspect", image).stdout)
    config = facts["Config"]
    size = facts["Size"]
    say("size, unpacked", arch != "amd64" or size <= MOST_BYTES, f"{size / 1e6:.0f} MB, at most {MOST_BYTES / 1e6:.0f}")
    say("user", config.get("User") not in ("", "root", "0"), config.get("User", ""))
    say("SIGTERM ends it", config.get("StopSignal") in ("SIGTERM", "15"), str(config.get("StopSignal")))
    say("one volume", len(config.get("Volumes") or {}) == 1, " ".join(config.get("Volumes") or {}))
    say("healthcheck", bool(facts.get("Healthcheck") or config.get("Healthcheck")))
    options = shlex.split(os.environ.get("CONTAINER_RUN_OPTIONS", ""))
    looks = (
        f"for tool in {TOOLS_OF_BUILDERS}; do command -v $tool; done; "
        "find / -xdev '(' -name cc1plus -o -name stdio.h ')'; "
        "find / -xdev -perm -o+w -type f -not -path '/proc/*' 2>/dev/null; ls -d /opt/telepresence/tests"
    )
    found = engine(
        "run", "--rm", "--pull", "never", "--platform", f"linux/{arch}", *options,
        "--entrypoint", "bash", image, "-c", looks,
    )  # fmt: skip
    say("neither compiler nor tests nor files that everybody may write", not found.stdout.strip(), found.stdout.strip())


def position(container: Container) -> tuple[float, float]:
    """Where the simulated robot is [m]."""
    text = container.ros("rostopic", "echo", "-n1", "/truth/pose/pose/position")
    found = [re.search(rf"{axis}: (\S+)", text) for axis in "xy"]
    if None in found:
        raise Failed(f"no /truth: {text}")
    return tuple(float(each[1]) for each in found if each)  # type: ignore[return-value]


def check_station(container: Container, newcomer: Newcomer, in_time: bool) -> None:
    """Open the page as a stranger, see and drive."""
    link = container.said
    wait_for(lambda: link(r"pilot's page (https://\S+)"), 120.0)
    place = link(r"pilot's page (https://\S+)")
    wait_for(lambda: reached(container.port), 300.0)
    print(f"  - the page is there after {time.monotonic() - container.started:.1f} s", flush=True)
    assert place is not None
    newcomer.tap(place[1])
    wait_for(newcomer.asks, 60.0)
    newcomer.evaluate("document.querySelector('[name=name]').value = 'anna'; "
                      "document.querySelector('#enterForm button').click()")  # fmt: skip
    wait_for(lambda: newcomer.first_picture() is not None and newcomer.evaluate(COLOURS) > LEAST_COLOURS, 300.0)
    took = time.monotonic() - container.started
    say("first picture after run", took <= FIRST_PICTURE_WITHIN or not in_time, f"{took:.1f} s")
    wait_for(newcomer.is_there, 120.0)
    wait_for(container.healthy, 60.0)
    say("healthcheck is green, way of the pictures", True, newcomer.way())
    begin = position(container)
    newcomer.hold_forward()
    wait_for(lambda: _distance(begin, position(container)) > 0.1, 60.0 if in_time else 300.0)
    newcomer.let_go()
    say("holding W in the page drives the robot", True)
    say("the window, which asks who one is, runs, too", "/gui_ros_node" in container.ros("rosnode", "list"))


def reached(port: int) -> bool:
    """Whether the page answers at the published port."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # its own certificate
    try:
        urllib.request.urlopen(f"https://localhost:{port}/", timeout=2.0, context=context).close()
    except OSError:
        return False
    return True


def _distance(one: tuple[float, float], other: tuple[float, float]) -> float:
    return ((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2) ** 0.5


def check_container(container: Container) -> None:
    """Look into the running container."""
    who = container.run("id", "-u").stdout.strip()
    say("runs as", who not in ("", "0"), who)
    tried = container.run("sh", "-c", "touch /opt/telepresence/x /x /etc/x; touch /var/lib/telepresence/x && echo kept")
    say("only the volume can be written", tried.stdout == "kept\n" and tried.stderr.count("Read-only") == 3)
    root = container.run("sh", "-c", "stat -c %u /proc/[0-9]* | sort -u").stdout.split()
    say("all programs are this user's", root == [who], " ".join(root))


def check_health(container: Container) -> None:
    """Stop each part, which starts again: killed ones are back before anybody sees them missing."""
    for name, part in PARTS.items():
        wait_for(container.healthy, 60.0)
        begin = time.monotonic()
        stopped = threading.Event()

        def keep_away(part: str = part, stopped: threading.Event = stopped) -> None:
            while not stopped.is_set():  # whoever starts it again has it killed again
                with contextlib.suppress(Failed):  # it is not back yet
                    container.kill(part, "SIGKILL")
                stopped.wait(0.2)

        killer = threading.Thread(target=keep_away)
        killer.start()
        try:
            wait_for(lambda: not container.healthy(), NOTICES_WITHIN)
            reason = container.health().stdout.strip()
        finally:
            stopped.set()
            killer.join()
        say(f"healthcheck is red without {name}", True, f"after {time.monotonic() - begin:.1f} s; {reason}")
    wait_for(container.healthy, 120.0)
    say("healthcheck is green again", True)


def check_end(container: Container, newcomer: Newcomer) -> None:
    """SIGTERM while the robot drives."""
    wait_for(newcomer.is_there, 60.0)
    begin = position(container)
    newcomer.hold_forward()
    wait_for(lambda: _distance(begin, position(container)) > 0.05, 60.0)
    asked = time.monotonic()
    engine("kill", "--signal", "TERM", container.name)
    wait_for(lambda: container.code is not None, ENDS_WITHIN)
    say("SIGTERM ends all of it", container.code == 0, f"{time.monotonic() - asked:.1f} s, exit code {container.code}")


def part_of(container: Container, newcomer: Newcomer | None) -> str:
    """What a person would look at when it does not work."""
    seen = newcomer.evaluate("document.body.innerText") if newcomer is not None else ""
    return "".join(container.lines[-30:]) + f"\nThe page says:\n{seen}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="./stack exec python tests/image", description=__doc__.partition("\n")[0])
    parser.add_argument("--image", default="telepresence")
    parser.add_argument("--arch", default="amd64", choices=("amd64", "arm64"), help="arm64 is emulated: no times hold")
    arguments = parser.parse_args()
    native = arguments.arch == {"x86_64": "amd64", "aarch64": "arm64"}.get(os.uname().machine)
    newcomer = container = None
    try:
        check_image(arguments.image, arguments.arch)
        container = Container(arguments.image, arguments.arch, "up", "pepper")
        newcomer = Newcomer(DESKTOP)
        check_station(container, newcomer, native)
        check_container(container)
        check_health(container)
        check_end(container, newcomer)
    except Failed as failed:
        wrong.append(str(failed))
        if container is not None:
            print(part_of(container, newcomer), file=sys.stderr)
    finally:
        if newcomer is not None:
            newcomer.tools.close()
        if container is not None:
            container.close()
    print("\nThe image is as it should be." if not wrong else "\nNot as it should be: " + "; ".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
