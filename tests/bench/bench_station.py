"""What the Pepper station with its window costs: processor and memory, program by program, at rest and on the way.

Everything of `./stack up pepper` counts: the simulated robot, the virtual screen and the pilot's page, too. On the way
the robot turns, and somebody also looks through the camera for the floor. Memory is what belongs to a program alone and
its part of what it shares (PSS).
"""

from __future__ import annotations

import contextlib
import subprocess
import time
from collections.abc import Iterator

from browser.whole_station import WholeStation, whole_station
from report import Row
from soak.samples import Usage

from telepresence.station import processes

SETTLED, SECONDS = 20.0, 30.0
TURN = "{angular: {z: 0.4}}"
"""[rad/s]"""
SECOND_CAMERA = "/pepper_robot/camera/bottom/image_raw"
LEAST = 0.003
"""What takes less of a processor [cores] and less memory than `LEAST_MEMORY` [MB] is one line of the table."""
LEAST_MEMORY = 8.0
LOOK = "import rospy; from sensor_msgs.msg import Image; rospy.init_node('looking', anonymous=True); \
rospy.Subscriber('{topic}', Image, lambda picture: None, queue_size=1, buff_size=2 << 20); rospy.spin()"


def run() -> list[Row]:
    with whole_station() as station:
        time.sleep(SETTLED)
        rest, memory = measure(station)
        with driven(station):
            time.sleep(5.0)
            driving, _ = measure(station)
    show(rest, driving, memory)
    return [
        Row("processor at rest", sum(rest.values()), 1.0, "cores", "one core"),
        Row("processor while it turns, two cameras", sum(driving.values()), 1.0, "cores", "one core"),
        Row("memory (PSS)", sum(memory.values()), 1000.0, "MB", "one GB"),
        Row("programs", len(memory), 1.0, "", "one"),
    ]


def measure(station: WholeStation) -> tuple[dict[str, float], dict[str, float]]:
    """Processor [cores] and memory [MB] of each program."""
    before, begin = station.usage(), time.monotonic()
    time.sleep(SECONDS)
    after, seconds = station.usage(), time.monotonic() - begin
    idle = Usage("", 0, 0, 0, 0, 0.0)
    cores = {name: (usage.cpu - before.get(name, idle).cpu) / seconds for name, usage in after.items()}
    return cores, {name: usage.pss / 1000.0 for name, usage in after.items()}


@contextlib.contextmanager
def driven(station: WholeStation) -> Iterator[None]:
    """The robot turns, and its second camera is looked through."""
    programs = [
        ["rostopic", "pub", "-r", "10", "/cmd_vel", "geometry_msgs/Twist", TURN],
        ["python3", "-c", LOOK.format(topic=SECOND_CAMERA)],
    ]
    running = [
        processes.start(words, env=station.environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        for words in programs
    ]
    try:
        yield
    finally:
        for process in running:
            processes.end(process)


def show(rest: dict[str, float], driving: dict[str, float], memory: dict[str, float]) -> None:
    """Print what each program takes; those that take next to nothing together."""
    small = [name for name in memory if max(rest[name], driving.get(name, 0.0)) < LEAST and memory[name] < LEAST_MEMORY]
    lines = [(name, rest[name], driving.get(name, 0.0), memory[name]) for name in memory if name not in small]
    lines.sort(key=lambda line: -line[2])
    together = [sum(values.get(name, 0.0) for name in small) for values in (rest, driving, memory)]
    lines.append((f"{len(small)} others", *together))
    width = max(len(line[0]) for line in lines)
    print(f"  {'program':<{width}}  {'at rest':>8}  {'turning':>8}  {'memory':>7}")
    for name, standing, turning, megabytes in lines:
        print(f"  {name:<{width}}  {standing:8.3f}  {turning:8.3f}  {megabytes:4.0f} MB")
