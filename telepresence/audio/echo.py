"""Echo cancellation by the sound server: the pilot's loudspeaker does not come back through the pilot's microphone.

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
_TIMEOUT = 5.0


class EchoCancellation:
    """Loaded from construction until `close`; play on `LOUDSPEAKER`, listen to `MICROPHONE`.

    Args:
        microphone, loudspeaker: The devices behind it; "auto" takes the sound server's usual ones.
    Raises:
        SoundError: There is no pactl or no sound server, or the server refuses; the text says which.
    """

    def __init__(self, microphone: str = "auto", loudspeaker: str = "auto") -> None:
        self._module = ""
        if shutil.which("pactl") is None:
            raise SoundError("echo cancellation needs pactl: apt-get install pulseaudio-utils")
        for line in _pactl("list", "short", "modules").splitlines():
            if MICROPHONE in line:  # left by a program that was killed
                _pactl("unload-module", line.split("\t")[0])
        masters = [
            f"{role}_master={device}"
            for role, device in (("source", microphone), ("sink", loudspeaker))
            if device not in ("", "auto")
        ]
        names = (f"source_name={MICROPHONE}", f"sink_name={LOUDSPEAKER}")
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
