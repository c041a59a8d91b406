"""Command line of what runs on the robot: `python -m rto_bringup.onboard drive|camera|sound`. Until SIGINT or SIGTERM.

The roles are imported only when asked for: the drive server runs where aiortc is not installed.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from telepresence.security.log_flood import LogFlood
from telepresence.security.robot_key import RobotKey, is_loopback
from telepresence.station import heartbeat, priority
from telepresence.stop_signals import heeded

if TYPE_CHECKING:
    from rto_bringup.onboard.picture_sources import PictureSource

log = logging.getLogger(__name__)

DRIVE_PORT, CAMERA_PORT, SOUND_PORT = 8082, 8083, 8084
ROBOT = LOOPBACK = "127.0.0.1"
KEY_FILE = "robot.key"
RECEIVER = "rosrun rto_node rto_camera_receiver _signaling:=copy-paste"
"""What runs on the pilot's side of an exchange by copy and paste."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one of the three programs; the exit status."""
    options = parse(sys.argv[1:] if arguments is None else arguments)
    logging.basicConfig(level=logging.INFO, format="%(levelname)s: %(message)s", handlers=log_handlers())
    logging.getLogger("aioice").setLevel(logging.WARNING)
    try:
        return options.run(options)
    except (OSError, ValueError) as error:
        print(f"onboard {options.role}: {error}", file=sys.stderr)
        return 1


def log_handlers() -> list[logging.Handler]:
    """All goes to standard error; under a supervisor only warnings do: in a station that is what a person sees. What
    strangers cause over and over is limited."""
    handlers: list[logging.Handler] = [logging.StreamHandler(sys.stderr)]
    if "NOTIFY_SOCKET" in os.environ:
        handlers[0].setLevel(logging.WARNING)
        handlers.append(logging.StreamHandler(sys.stdout))
        handlers[1].addFilter(lambda record: record.levelno < logging.WARNING)
    for handler in handlers:
        handler.addFilter(LogFlood())
    return handlers


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m rto_bringup.onboard", description="What runs on the robot.")
    roles = parser.add_subparsers(dest="role", required=True)
    drive = roles.add_parser("drive", help="takes velocities by UDP, gates them with the robot's own sensors")
    camera = roles.add_parser("camera", help="sends the camera's pictures by WebRTC")
    sound = roles.add_parser("sound", help="talks with the pilot by WebRTC: the robot's microphone and loudspeaker")
    ports = ((drive, DRIVE_PORT, run_drive), (camera, CAMERA_PORT, run_camera), (sound, SOUND_PORT, run_sound))
    for role, port, run in ports:
        role.add_argument(
            "--address",
            help=f"where to listen: this robot's address in the pilot's network, 0.0.0.0 for all (default: {LOOPBACK}, "
                 "which only this machine reaches; with --copy-paste all but that)",
        )  # fmt: skip
        role.add_argument(
            "--key", type=Path, metavar="FILE",
            help=f"the robot's key, made with the bundle, which pilots need; wanted with any address but {LOOPBACK} "
                 f"(default: {KEY_FILE} beside the bundle, if it is there)",
        )  # fmt: skip
        role.add_argument("--port", type=int, default=port, help="0 takes a free one (default: %(default)s)")
        role.set_defaults(run=run)
    drive.add_argument("--robot", default=ROBOT, help="the robot's own web server (default: %(default)s)")
    drive.add_argument("--laser", action="store_true", help="the robot carries a laser scanner: gate with it too")
    drive.add_argument(
        "--kept", type=Path, metavar="FILE",
        help="where a stop or a bump is kept while the program is started again (default: in $RUNTIME_DIRECTORY, else "
             "in the station's folder, else nowhere)",
    )  # fmt: skip
    camera.add_argument(
        "--source", default=ROBOT,
        help="the robot's web server, whose /cam0 is asked; a device such as /dev/video0; or test (default: "
             "%(default)s)",
    )  # fmt: skip
    camera.add_argument("--rate", type=float, default=30.0, help="pictures per second, at most (default: %(default)s)")
    camera.add_argument("--size", default="640x480", type=_size, help="size of a device's pictures (default: 640x480)")
    camera.add_argument(
        "--copy-paste", action="store_true", help="print the offer and read the answer, instead of serving by HTTP"
    )
    camera.add_argument("--time", action="store_true", help="copy and paste: draw the time into the pictures")
    for end in ("microphone", "speaker"):
        sound.add_argument(
            f"--{end}", default="auto", metavar="DEVICE",
            help="auto, none, test, alsa:DEVICE, or a name of the sound server (default: %(default)s)",
        )  # fmt: skip
    sound.add_argument(
        "--patience", type=float, default=0.0,
        help="seconds of delay accepted on top, for a busy machine or a poor network (default: %(default)s)",
    )  # fmt: skip
    return parser.parse_args(arguments)


def find_key(options: argparse.Namespace) -> RobotKey | None:
    """Return the key that pilots need; None on loopback without one: whoever is on this machine may then drive it.

    Raises:
        ValueError: There is none and the address is not loopback, or the key cannot be used; the text has the remedy.
        OSError: It cannot be read.
    """
    path = options.key or _key_beside_bundle()
    if path is not None:
        return RobotKey.read(path)
    address = options.address or LOOPBACK
    if not is_loopback(address):
        raise ValueError(
            f"without a key nothing listens on {address}, where strangers are: name the robot's key with --key FILE "
            f"(make_bundle.py makes one, docs/robotino.md), or listen on {LOOPBACK}"
        )
    return None


def _key_beside_bundle() -> Path | None:
    bundle = next((each for each in Path(__file__).absolute().parents if each.is_file()), None)
    beside = bundle.with_name(KEY_FILE) if bundle else None
    return beside if beside is not None and os.path.lexists(beside) else None


def run_drive(options: argparse.Namespace) -> int:
    from rto_bringup.onboard.kept_latches import KeptLatches, default_path
    from rto_bringup.onboard.robotino_base import RobotinoBase
    from telepresence.drive.server import DriveServer

    key, address = find_key(options), options.address or LOOPBACK
    kept = KeptLatches(options.kept or default_path(options.port))
    base = RobotinoBase(options.robot, options.laser, kept)
    server = DriveServer(base, address, options.port, key, log.info)
    with base, contextlib.closing(server):
        for number in heeded(signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, lambda *_: server.stop())
        priority.put_commands_first()  # not of whoever only finds out that the port is taken
        heartbeat.notify("READY=1")
        print(f"drive server listens on udp://{server.address}:{server.port}", flush=True)
        return server.run()


def run_sound(options: argparse.Namespace) -> int:
    from rto_bringup.onboard.sound_server import SoundServer, serve_sound

    key = find_key(options)

    async def talk() -> None:
        server = SoundServer(options.microphone, options.speaker, options.patience, key)
        ready = "sound server listens on {}".format
        work = asyncio.ensure_future(
            serve_sound(server, options.address or LOOPBACK, options.port, lambda url: print(ready(url), flush=True))
        )
        loop = asyncio.get_running_loop()
        for number in heeded(signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, work.cancel)
        with contextlib.suppress(asyncio.CancelledError):
            await work

    asyncio.run(talk())
    return 0


def run_camera(options: argparse.Namespace) -> int:
    from rto_bringup.onboard.picture_sources import open_source

    key = None if options.copy_paste else find_key(options)  # nothing listens for offers then: a person carries them
    source = open_source(options.source, options.rate, options.size)
    try:
        return asyncio.run(_send_pictures(options, source, key))
    finally:
        source.close()


async def _send_pictures(options: argparse.Namespace, source: PictureSource, key: RobotKey | None) -> int:
    from rto_bringup.onboard.camera_server import CameraServer, serve
    from telepresence.video.copy_paste_signaling import CopyPasteSignaling

    server = CameraServer(source, key)
    if options.copy_paste:
        signaling = CopyPasteSignaling(f"the receiver's terminal ({RECEIVER})")
        sending = server.send_by_copy_and_paste(signaling, options.address, options.time)
    else:
        sending = serve(server, options.address or LOOPBACK, options.port, _announce)
    work = asyncio.ensure_future(sending)
    loop = asyncio.get_running_loop()
    for number in heeded(signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        loop.add_signal_handler(number, work.cancel)
    with contextlib.suppress(asyncio.CancelledError):
        await work
    return 0


def _announce(url: str) -> None:
    print(f"camera sender listens on {url}", flush=True)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdigit() and height.isdigit() and 80 <= int(width) <= 4096 and 80 <= int(height) <= 4096):
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 640x480")
    return int(width), int(height)


if __name__ == "__main__":
    sys.exit(main())
