"""Echo cancellation by the sound server: what the pilot's loudspeaker plays is removed from the pilot's microphone.

PulseAudio's module-echo-cancel (PipeWire has one of the same name) stands before a microphone and a loudspeaker, and
offers a cleaned microphone and a loudspeaker whose sound it knows. It is loaded, watched and unloaded through `pactl`.
It goes with the sound server, and when one of the devices behind it is unplugged, when the server moves the streams to
other devices without an error: so it is looked after before a device is opened, and both are opened anew when it has
gone. It holds the microphone, so that it is loaded only while that is wanted.
"""

from __future__ import annotations

import logging
import shutil
import subprocess
import threading
from collections.abc import Callable

from telepresence.audio.pipeline import SoundError
from telepresence.station import processes

log = logging.getLogger(__name__)

MICROPHONE, LOUDSPEAKER = "telepresence_echo_free", "telepresence_echo_known"
"""Names of the sound server's devices, followed by the name of their owner."""
_TIMEOUT = 5.0
_ROLES = ("source", "sink")


class EchoCancellation:
    """Stands between the chosen devices and the program until `close`; may be asked from several threads.

    What cannot be cancelled is used as it is, with a warning: there is no pactl, the sound server refuses, or one of
    the devices is away. A choice that is none of the sound server's devices needs no cancellation.

    Args:
        microphone, loudspeaker: What is chosen at first, see `telepresence.audio.devices`.
        owner: A word that distinguishes several on one sound server.
    Attributes:
        wanted: False while the microphone is not; takes effect with the next opening of a device.
    """

    def __init__(self, microphone: str = "auto", loudspeaker: str = "auto", owner: str = "pilot") -> None:
        self.wanted = True
        self._choices = dict(zip(_ROLES, (microphone, loudspeaker), strict=True))
        self._names = dict(zip(_ROLES, (f"{MICROPHONE}_{owner}", f"{LOUDSPEAKER}_{owner}"), strict=True))
        self._given: dict[str, str] = {}  # what each end has opened
        self._reopen: dict[str, Callable[[], None]] = {}
        self._masters: dict[str, str] | None = None  # of the module that is loaded
        self._watcher: subprocess.Popen[str] | None = None
        self._told = ""
        self._lock = threading.Lock()

    def join(self, reopen_microphone: Callable[[], None], reopen_loudspeaker: Callable[[], None]) -> None:
        """Have an end opened anew when what it should use has changed; both return at once."""
        self._reopen = dict(zip(_ROLES, (reopen_microphone, reopen_loudspeaker), strict=True))

    def microphone(self, choice: str) -> str:
        """Return the device to open for the microphone that is chosen."""
        return self._device("source", choice)

    def loudspeaker(self, choice: str) -> str:
        """Return the device to open for the loudspeaker that is chosen."""
        return self._device("sink", choice)

    def close(self) -> None:
        with self._lock:
            self.wanted = False
            if self._masters is not None:
                try:
                    self._unload(self._modules())
                except SoundError as error:
                    log.info("echo cancellation stays loaded: %s", error)
            self._unwatch()

    def _device(self, role: str, choice: str) -> str:
        with self._lock:
            self._choices[role] = choice
            loaded = False
            try:
                loaded = self._arrange(role)
            except SoundError as error:
                self._report(f"{error}; use a headset")
            self._given[role] = self._names[role] if loaded else choice
            return self._given[role]

    def _arrange(self, role: str) -> bool:
        """Load or unload the module, as things stand, for an end that is about to be opened; whether it is there.

        Raises:
            SoundError: It should be, and cannot; the text says why.
        """
        wanted = self.wanted and all(_is_servers(choice) for choice in self._choices.values())
        try:
            found = self._modules()
        except SoundError:
            self._masters = None
            if wanted:
                raise
            return False
        if wanted and len(found) == 1 and self._masters == self._choices:
            return True
        if found:  # left by a program that was killed, for other devices, or not wanted any more
            self._reopen_other(role, lambda device: True)
            self._unload(found)
        self._masters = None
        if wanted:
            self._load()
            self._reopen_other(role, lambda device: device not in self._names.values())
            if self._told:
                log.info("echo cancellation works")
            self._told = ""
        return wanted

    def _load(self) -> None:
        masters = [f"{role}_master={device}" for role, device in self._choices.items() if device not in ("", "auto")]
        names = [f"{role}_name={name}" for role, name in self._names.items()]
        number = _pactl("load-module", "module-echo-cancel", "aec_method=webrtc", *names, *masters).strip()
        self._masters = dict(self._choices)
        self._unwatch()
        self._watcher = processes.start(
            ["pactl", "subscribe"], tied=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        threading.Thread(
            target=self._watch, args=(self._watcher, number), name="echo-cancellation", daemon=True
        ).start()

    def _watch(self, watcher: subprocess.Popen[str], module: str) -> None:
        """Have both ends opened anew when the module goes; ends with the sound server, or when it is let go of."""
        with watcher:
            for line in watcher.stdout or ():
                if line.strip() == f"Event 'remove' on module #{module}" and watcher is self._watcher:
                    log.warning("echo cancellation has gone: was a sound device unplugged?")
                    for reopen in self._reopen.values():
                        reopen()

    def _unwatch(self) -> None:
        watcher, self._watcher = self._watcher, None
        if watcher is not None:
            watcher.kill()  # the thread that reads it waits for it

    def _unload(self, modules: list[str]) -> None:
        self._unwatch()
        for number in modules:
            _pactl("unload-module", number)
        self._masters = None

    def _modules(self) -> list[str]:
        """Numbers of our own on the sound server."""
        ours = f"source_name={self._names['source']} "
        return [line.split("\t")[0] for line in _pactl("list", "short", "modules").splitlines() if ours in f"{line} "]

    def _reopen_other(self, role: str, concerns: Callable[[str], bool]) -> None:
        """Have the other end opened anew if what it has opened is of those."""
        for other, device in self._given.items():
            if other != role and concerns(device) and other in self._reopen:
                self._reopen[other]()

    def _report(self, problem: str) -> None:
        if problem != self._told:
            log.warning("%s", problem)
            self._told = problem


def _is_servers(choice: str) -> bool:
    """Whether a choice is a device of the sound server."""
    return choice not in ("none", "test") and not choice.startswith("alsa:")


def _pactl(*arguments: str) -> str:
    if shutil.which("pactl") is None:
        raise SoundError("echo cancellation needs pactl: apt-get install pulseaudio-utils")
    try:
        done = subprocess.run(["pactl", *arguments], capture_output=True, text=True, timeout=_TIMEOUT)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SoundError(f"the sound server does not answer: {error}") from None
    if done.returncode:
        raise SoundError(f"no echo cancellation: the sound server says {done.stderr.strip() or done.returncode}")
    return done.stdout
