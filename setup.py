"""Python packages of the telepresence stack; the ROS packages live in catkin_ws and are built by catkin.

Versions are pinned: the same tree gives the same robot next year. What these need themselves, and the hashes of all
files, is in requirements/stack.txt; after a change here run ./stack lock.
"""

from setuptools import find_packages, setup

# setproctitle: a node that was forked has the name of its program in ps.
CORE = ["numpy==2.2.6", "opencv-python-headless==4.12.0.88", "setproctitle==1.3.8"]
X86 = "platform_machine == 'x86_64'"

EXTRAS = {
    # mujoco-core: physics and the classic renderer without Studio.
    "sim": ["mujoco-core[rendering]==4.0.0"],
    # gevent serves endless MJPEG responses without a thread per viewer; flask holds the pages.
    # aiortc: WebRTC in pure Python, on the robot too.
    "media": ["flask==3.1.3", "gevent==26.9.0", "aiortc==1.16.0", "aiohttp==3.14.5"],
    # argon2-cffi: what accounts keep of a password (the wheel: Debian 12's is of 2021); cryptography: X25519, by which
    # windows and drive_lease agree on a key. aiortc brings the latter, too. PyQt5 has no wheel for arm64: ./stack takes
    # Debian's there.
    "gui": [f"PyQt5==5.15.11; {X86}", "argon2-cffi==25.1.0", "cryptography==50.0.2"],
    # pytest-xdist: two tests at a time; pytest-timeout: a test that hangs says where; pytest-rerunfailures: what fails
    # on a machine that had no time is tried again, and the summary counts it. qi: the vendor's own messaging library,
    # the stranger whom ours must understand; tests alone need it, and there are wheels for few machines.
    "dev": [
        "pytest==9.0.1",
        "pytest-rerunfailures==16.7",
        "pytest-xdist==3.8.0",
        "pytest-timeout==2.4.0",
        "hypothesis==6.148.1",
        "matplotlib==3.10.8",
        "ruff==0.14.5",
        "mypy==2.4.1",
        "websockets==15.0.1",
        f"qi==3.1.5; {X86} and python_version < '3.13'",
    ],
}

setup(
    name="telepresence",
    version="0.9.0",
    description="Telepresence and safe teleoperation of Pepper and Robotino on ROS 1, with or without the robot",
    license="BSD-3-Clause",
    python_requires=">=3.11",
    packages=find_packages(include=["telepresence*", "pepper_sim*", "robotino_sim*", "gui*"]),
    package_data={
        "telepresence.page": ["static/*"],
        "telepresence.site": ["static/*"],
        "telepresence.sim": ["scenes/*.xml", "scenes/parts/*.xml", "scenes/textures/*.png"],
        "telepresence.sim.walker": ["*.xml"],
        "pepper_sim": ["models/*", "documented/*.toml", "animations/*.toml"],
        "robotino_sim": ["models/*"],
        "gui": ["*.ui", "themes/*"],
        "gui.app": ["*.ui"],
        "gui.driving": ["*.ui"],
        "gui.terminal": ["*.conf", "*.bashrc"],
    },
    install_requires=CORE,
    extras_require=EXTRAS,
    entry_points={
        # Kinds of robots that a simulated world can hold, see telepresence.sim.simulated_robot.
        "telepresence.robots": [
            "pepper = pepper_sim.simulation:SimulatedPepper",
            "robotino = robotino_sim.simulation:SimulatedRobotino",
            "walker = telepresence.sim.walker:SimulatedWalker",
        ],
    },
)
