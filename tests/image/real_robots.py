"""A real robot from inside a container: the robot in a network of its own, and published ports alone lead inside.

    robot 10.97.0.2 -- 10.97.0.1 host -- the engine's bridge -- container

The simulated robots play the real ones; what they send to the host must be let in by a published port. On Linux the
host reaches a container's own address, too; here what comes there by UDP is dropped, as it is elsewhere. Needs root.
"""

from __future__ import annotations

import contextlib
import math
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from container import Container, Failed, say, wait_for
from machines import Machine
from newcomer import Newcomer
from page_sound import ORANGE, SETTLED, Likeness, camera, devices, microphone, recorded
from sound_lab import RATE, sentence
from stranger import come_in, looked_at

from pepper_sim.simulation import Simulation as PepperWorld
from robotino_sim.simulation import Simulation as RobotinoWorld

HOST, ROBOT = "10.97.0.1", "10.97.0.2"
WIRE = "to-robot"
UNPUBLISHED = """
table ip unpublished {{
  chain leaving {{
    type filter hook output priority 0
    ip daddr {address} meta l4proto udp ct status & dnat == 0 drop
  }}
  chain coming {{ type filter hook input priority 0; ip saddr {address} meta l4proto udp ct state new drop; }}
}}
"""
NAOQI_PORT, REST_PORT, TABLET_PORT = 9559, 80, 10002
PATIENCE = 90.0
"""[s] for whatever a person would wait for."""
PILOT_SAYS = "Good morning. May I come in?"
ROBOT_HEARS = "Please be careful, the cat is asleep."
FAR_ENOUGH = 0.1
"""[m]"""


@contextlib.contextmanager
def robot_machine() -> Iterator[Machine]:
    """Make the robot's machine, and the wire to it. Raises Failed."""
    machine = Machine()
    try:
        for words in (
            ("ip", "link", "add", WIRE, "type", "veth", "peer", "name", WIRE, "netns", str(machine.holder.pid)),
            ("ip", "addr", "add", f"{HOST}/24", "dev", WIRE),
            ("ip", "link", "set", WIRE, "up"),
            machine.command("ip", "addr", "add", f"{ROBOT}/24", "dev", WIRE),
            machine.command("ip", "link", "set", WIRE, "up"),
        ):
            answer = subprocess.run(words, capture_output=True, text=True, timeout=10)
            if answer.returncode:
                raise Failed(f"no network for the robot (this needs root): {answer.stderr.strip()}")
        yield machine
    finally:
        subprocess.run(("ip", "link", "del", WIRE), capture_output=True, timeout=10)  # the next one has the same name
        machine.close()


def drives(newcomer: Newcomer, world: Any, name: str) -> None:
    """Hold W until the robot has moved."""
    wait_for(newcomer.is_there, PATIENCE)
    begin = world.truth(name)
    newcomer.hold_forward()
    try:
        wait_for(lambda: math.dist((begin.x, begin.y), (world.truth(name).x, world.truth(name).y)) > FAR_ENOUGH, 60.0)
    finally:
        newcomer.let_go()


def press(newcomer: Newcomer, tool: str) -> None:
    """Press a tool of the page once it is offered."""
    wait_for(lambda: not newcomer.evaluate(f"document.getElementById('{tool}').hidden"), PATIENCE)
    newcomer.evaluate(f"document.getElementById('{tool}').click()")


def check_voice(newcomer: Newcomer, world: PepperWorld, spoken: np.ndarray) -> None:
    """What the browser's microphone records comes out of the robot."""
    likeness, period = Likeness(spoken), len(spoken) / RATE

    def comes_out() -> bool:
        """the pilot's voice comes out of the robot"""
        time.sleep(period / 2)
        return likeness.listen(
            world.room.loudspeaker.track.render(time.monotonic() - 2 * period, int(2 * period * RATE), RATE)
        )

    press(newcomer, "tool_microphone")
    wait_for(comes_out, PATIENCE)
    press(newcomer, "tool_microphone")
    say("the pilot's voice comes out of the robot", True, f"likeness {min(likeness.best):.2f} at least")


def check_ear(newcomer: Newcomer, world: PepperWorld) -> None:
    """The page plays what is said beside the robot."""
    theirs = sentence(ROBOT_HEARS, "en-gb")
    likeness = Likeness(theirs)

    def is_played() -> bool:
        """the page plays what is said beside the robot"""
        world.room.surroundings.play(theirs, RATE, time.monotonic() + 0.2)
        return likeness.listen(recorded(newcomer, len(theirs) / RATE + 1.5))

    wait_for(lambda: newcomer.evaluate("document.getElementById('tool_speaker').ariaPressed === 'true'"), PATIENCE)
    wait_for(is_played, PATIENCE)
    say("the page plays what is said beside the robot", True, f"likeness {min(likeness.best):.2f} at least")


def check_tablet(newcomer: Newcomer, world: PepperWorld) -> None:
    """The robot's tablet fetches its page from the host, and shows the pilot."""

    def shows_the_pilot() -> bool:
        """the tablet shows the pilot's camera"""
        picture = world.tablet.image.peek()
        return picture is not None and max(
            abs(int(seen) - filmed) for seen, filmed in zip(picture.content[200, 320], ORANGE, strict=True)
        ) < 20  # fmt: skip

    press(newcomer, "tool_camera")
    wait_for(shows_the_pilot, PATIENCE)
    say("the tablet fetches its page by the published port, and shows the pilot", True)
    press(newcomer, "tool_camera")


def check_doctor(container: Container, port: int) -> None:
    """The doctor, inside, reaches the robot and names what published ports cannot do."""
    answer = container.run("/opt/telepresence/stack", "doctor", f"{ROBOT}:{port}").stdout
    say("./stack doctor reaches the robot", f"✓ robot at {ROBOT}:{port}" in answer)
    say("./stack doctor names what needs --network host", "--network host" in answer)


def check_link(container: Container, machine: Machine) -> None:
    """The robot's cable is pulled, and put in again."""
    wait_for(container.healthy, PATIENCE)
    machine.run("ip", "link", "set", WIRE, "down")
    took = wait_for(lambda: not container.healthy(), 30.0)
    machine.run("ip", "link", "set", WIRE, "up")
    say("healthcheck is red without the robot's cable", True, f"after {took:.1f} s; {container.complaint}")
    back = wait_for(container.healthy, PATIENCE)
    say("and green again with it", True, f"after {back:.1f} s")


@contextlib.contextmanager
def published_alone(container: Container) -> Iterator[None]:
    """Drop datagrams between host and container that no published port has let in, but for what answers the container.
    Raises Failed."""
    wait_for(container.address, 30.0)
    rules = UNPUBLISHED.format(address=container.address())
    made = subprocess.run(("nft", "-f", "-"), input=rules, capture_output=True, text=True, timeout=10)
    if made.returncode:
        raise Failed(f"no firewall: {made.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(("nft", "delete", "table", "ip", "unpublished"), check=True, timeout=10)


@contextlib.contextmanager
def station(image: str, arch: str, folder: Path, *words: str, options: tuple[str, ...] = ()) -> Iterator[Any]:
    """Run a container, and a browser with a microphone and a camera; give both and what the microphone records."""
    sound, film = folder / "pilot.wav", folder / "pilot.y4m"
    spoken = microphone(sound, PILOT_SAYS)
    camera(film)
    container = Container(image, arch, *words, options=options)
    with looked_at(container, SETTLED, devices(sound, film)) as newcomer, published_alone(container):
        say("first picture after run", True, f"{come_in(container, newcomer):.1f} s")
        wait_for(lambda: newcomer.way() in ("direct", "slower"), PATIENCE)
        say("pictures and sound come by published ports", newcomer.way() == "direct", newcomer.way())
        yield container, newcomer, spoken


def check_pepper(image: str, arch: str) -> None:
    """Drive, see, speak, listen and be seen. Raises Failed."""
    words = ("up", "pepper", "sim:=false", f"nao_ip:={ROBOT}", f"roscore_ip:={HOST}")
    published = ("--publish", f"{HOST}:{TABLET_PORT}:{TABLET_PORT}")
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        machine = stack.enter_context(robot_machine())
        with machine.entered():
            world = stack.enter_context(PepperWorld("apartment", 0, ROBOT, NAOQI_PORT, tablet_browser="chromium"))
        parts = stack.enter_context(station(image, arch, folder, *words, options=published))
        container, newcomer, spoken = parts
        drives(newcomer, world, "pepper")
        say("holding W in the page drives the robot", True)
        check_voice(newcomer, world, spoken)
        check_ear(newcomer, world)
        check_tablet(newcomer, world)
        check_doctor(container, NAOQI_PORT)
        check_link(container, machine)


def check_robotino(image: str, arch: str) -> None:
    """Drive and see. Raises Failed."""
    words = ("up", "robotino", "sim:=false", "camera:=cam0", f"robotino_ip:={ROBOT}")
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        machine = stack.enter_context(robot_machine())
        with machine.entered():
            world = stack.enter_context(RobotinoWorld("apartment", 0, ROBOT, REST_PORT))
        container, newcomer, _ = stack.enter_context(station(image, arch, folder, *words))
        drives(newcomer, world, "robotino")
        say("holding W in the page drives the robot", True)
        check_doctor(container, REST_PORT)
        check_link(container, machine)
