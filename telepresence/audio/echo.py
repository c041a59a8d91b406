"""Echo cancellation by the sound server: what the pilot's loudspeaker plays is removed from the pilot's microphone.

PulseAudio's module-echo-cancel (PipeWire has one of the same name) offers a cleaned microphone and a loudspeaker whose
sound it knows. It is loaded and unloaded through `pactl`.
"""

from __future__ import annotations

import logging
import shutil
import subprocess

from telepresence.audio.pipeline import SoundError

log = logging.getLogger(__name__)

MICROPHONE, LOUDSPEAKER = "telepresence_echo_free", "telepresence_echo_known"
"""Names of the sound server's devices, followed by the name of their owner."""
_TIMEOUT = 5.0


def without_echo(microphone: str, loudspeaker: str, owner: str) -> tuple[str, str, EchoCancellation | None]:
    """Return the devices to use and what to close at the end; the given devices, with a warning, if it fails."""
    try:
        echo = EchoCancellation(microphone, loudspeaker, owner)
    except SoundError as error:
        log.warning("%s; use a headset", error)
        return microphone, loudspeaker, None
    return echo.microphone, echo.loudspeaker, echo


class EchoCancellation:
    """Echo cancellation from construction until `close`, between its devices `loudspeaker` and `microphone`.

    Args:
        microphone, loudspeaker: The devices behind it; "auto" takes the sound server's usual ones.
        owner: A word that distinguishes several on one sound server.
    Raises:
        SoundError: There is no pactl or no sound server, or the server refuses; the text says which.
    """

    def __init__(self, microphone: str = "auto", loudspeaker: str = "auto", owner: str = "pilot") -> None:
        self._module = ""
        self.microphone, self.loudspeaker = f"{MICROPHONE}_{owner}", f"{LOUDSPEAKER}_{owner}"
        if shutil.which("pactl") is None:
            raise SoundError("echo cancellation needs pactl: apt-get install pulseaudio-utils")
        for line in _pactl("list", "short", "modules").splitlines():
            if f"source_name={self.microphone} " in line:  # left by a program that was killed
                _pactl("unload-module", line.split("\t")[0])
        masters = [
            f"{role}_master={device}"
            for role, device in (("source", microphone), ("sink", loudspeaker))
            if device not in ("", "auto")
        ]
        names = (f"source_name={self.microphone}", f"sink_name={self.loudspeaker}")
        self._module = _pactl("load-module", "module-echo-cancel", "aec_method=webrtc", *names, *masters).strip()

    def close(self) -> None:
        if self._module:
            try:
                _pactl("unload-module", self._module)
            except SoundError as error:
                log.info("echo cancellation stays loaded: %s", error)
            self._module = ""


def _pactl(*arguments: str) -> str:
    try:
        done = subprocess.run(["pactl", *arguments], capture_output=True, text=True, timeout=_TIMEOUT)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SoundError(f"the sound server does not answer: {error}") from None
    if done.returncode:
        raise SoundError(f"no echo cancellation: the sound server says {done.stderr.strip() or done.returncode}")
    return done.stdout
