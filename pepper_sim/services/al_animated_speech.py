"""ALAnimatedSpeech: speech with body language and instructions. Source: NAOqi 2.8 documentation, ALAnimatedSpeech.

A text is said piece by piece, and the instructions between the pieces are carried out in their turn: ^start, ^run,
^stop and ^wait with an animation, the same with Tag for a tag and with Sound for a sound, ^mode, ^call and ^pCall with
a method of any service, and $event=value. What cannot be carried out is logged, and the text goes on. Texts are said
one after the other; what a text has started ends with it.
"""

from __future__ import annotations

import concurrent.futures
import itertools
import logging
import threading
from collections.abc import Mapping
from typing import Any

from pepper_sim.animations.annotated_text import Event, Instruction, Words, parse, parse_call
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.service import Module, ServiceError, one_of, remote, shown
from pepper_sim.naoqi.speech_tags import lasting_tags, spoken
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.services.al_animation_player import ALAnimationPlayer
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_speaking_movement import ALSpeakingMovement
from pepper_sim.services.al_text_to_speech import MAX_TEXT, ALTextToSpeech

log = logging.getLogger(__name__)

MODES = ("disabled", "random", "contextual")
MAX_WAITING = 20
"""Texts that may wait for their turn."""
END_EVENT = "ALAnimatedSpeech/EndOfAnimatedSpeech"
_ACTIONS = ("start", "run", "stop", "wait")


class ALAnimatedSpeech(Module):
    """Says texts with body language."""

    name = "ALAnimatedSpeech"

    def __init__(
        self,
        speech: ALTextToSpeech,
        animations: ALAnimationPlayer,
        movement: ALSpeakingMovement,
        memory: ALMemory,
        clients: ClientServices,
        workers: Workers,
    ) -> None:
        self._speech = speech
        self._animations = animations
        self._movement = movement
        self._memory = memory
        self._clients = clients
        self._workers = workers
        self._lock = threading.Lock()
        self._waiting: list[_Performance] = []
        self._numbers = itertools.count(1)
        memory.declare((END_EVENT,), self.name)

    def close(self) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for performance in waiting:
            performance.stop()

    # --- saying ------------------------------------------------------------------------------------------------------

    @remote("v(s)", "v(sm)")
    def say(self, text: str, configuration: Any = None) -> concurrent.futures.Future:
        """Says a text with instructions; configuration: {"bodyLanguageMode": see setBodyLanguageModeFromStr}."""
        if len(text) > MAX_TEXT:
            raise ServiceError(f"the text has {len(text)} characters; at most {MAX_TEXT} can be said at once")
        performance = _Performance(self, parse(text), self._mode_of(configuration), next(self._numbers))
        with self._lock:
            if len(self._waiting) > MAX_WAITING:
                raise ServiceError(f"{MAX_WAITING} texts are already waiting")
            self._waiting.append(performance)
            first = len(self._waiting) == 1
        if first:
            self._workers.run(self._perform)
        return performance.answer

    # --- body language, older methods --------------------------------------------------------------------------------

    @remote("v(I)")
    def setBodyLanguageMode(self, bodyLanguageMode: int) -> None:
        """Sets 0 disabled, 1 random, 2 contextual."""
        self.setBodyLanguageModeFromStr(MODES[one_of(bodyLanguageMode, (0, 1, 2), "bodyLanguageMode")])

    @remote("v(s)")
    def setBodyLanguageModeFromStr(self, stringBodyLanguageMode: str) -> None:
        """Sets "disabled", "random" or "contextual"."""
        one_of(stringBodyLanguageMode, MODES, "stringBodyLanguageMode")
        self._movement.setEnabled(stringBodyLanguageMode != "disabled")
        if stringBodyLanguageMode != "disabled":
            self._movement.setMode(stringBodyLanguageMode)

    @remote("I()")
    def getBodyLanguageMode(self) -> int:
        """Returns 0 disabled, 1 random, 2 contextual."""
        return MODES.index(self.getBodyLanguageModeToStr())

    @remote("s()")
    def getBodyLanguageModeToStr(self) -> str:
        """Returns "disabled", "random" or "contextual"."""
        return self._movement.getMode() if self._movement.isEnabled() else "disabled"

    @remote("b()")
    def isBodyTalkEnabled(self) -> bool:
        """Whether body language is on."""
        return self._movement.isEnabled()

    @remote("v(b)")
    def setBodyTalkEnabled(self, enable: bool) -> None:
        """Switches body language on or off."""
        self._movement.setEnabled(enable)

    @remote("b()")
    def isBodyLanguageEnabled(self) -> bool:
        """Whether body language is on."""
        return self._movement.isEnabled()

    @remote("v(b)")
    def setBodyLanguageEnabled(self, enable: bool) -> None:
        """Switches body language on or off."""
        self._movement.setEnabled(enable)

    @remote("v(m)")
    def addTagsToWords(self, tagsToWords: Any) -> None:
        """Links words with tags of animations: {tag: [word, ...]}."""
        self._movement.addTagsToWords(tagsToWords)

    @remote("v(s)")
    def declareAnimationsPackage(self, animationsPackage: str) -> None:
        """Makes the tagged behaviours of a package known."""
        self._animations.declarePathForTags(f"{animationsPackage}/[posture]/")

    @remote("v(m)")
    def declareTagForAnimations(self, tagsToAnimations: Any) -> None:
        """Gives tags to animations: {tag: [path, ...]}."""
        self._animations.addTagForAnimations(tagsToAnimations)

    # --- carrying out, on a worker -----------------------------------------------------------------------------------

    def _perform(self) -> None:
        """Say what waits, one after the other. Whether this worker goes on is decided as a text leaves the queue: the
        next text finds either this worker or an empty queue, and is said by one worker only."""
        waiting = self._waiting[:1]
        while waiting:
            (performance,) = waiting
            failure: Exception | None = None
            try:
                performance.run()
            except Exception as error:  # top of a thread: a text that fails must not keep the others waiting
                failure = error
                log.warning("a text could not be said: %s", error, exc_info=not isinstance(error, ServiceError))
            with self._lock:
                if performance in self._waiting:
                    self._waiting.remove(performance)
                waiting = self._waiting[:1]
            self._memory.announce(END_EVENT, performance.number)
            performance.finish(failure)

    def _mode_of(self, configuration: Any) -> str:
        """Return the mode for one text. Clients send [] or nothing for the general setting."""
        if configuration is None or (isinstance(configuration, list | tuple) and not configuration):
            return ""
        if isinstance(configuration, list | tuple) and all(
            isinstance(pair, list | tuple) and len(pair) == 2 for pair in configuration
        ):
            configuration = dict(configuration)
        if not isinstance(configuration, Mapping):
            raise ServiceError(f"configuration must be a map, got {shown(configuration)}")
        mode = configuration.get("bodyLanguageMode", MODES[2])
        return one_of(mode, MODES, "bodyLanguageMode")


class _Performance:
    """One text being said."""

    def __init__(
        self, service: ALAnimatedSpeech, items: list[Words | Instruction | Event], mode: str, number: int
    ) -> None:
        self.number = number
        self.answer: concurrent.futures.Future = concurrent.futures.Future()
        self.answer.add_done_callback(lambda done: self.stop() if done.cancelled() else None)
        self._service = service
        self._items = items
        self._mode = mode
        self._stopped = threading.Event()
        self._current: concurrent.futures.Future | None = None
        self._started: dict[str, concurrent.futures.Future] = {}

    def run(self) -> None:
        """Carry out everything in its turn."""
        tags = ""
        try:
            for item in self._items:
                if self._stopped.is_set():
                    return
                if isinstance(item, Words):
                    text = tags + item.text
                    if not spoken(text):
                        tags = text  # bookmarks and pauses without words come with the next ones
                        continue
                    if not self._say(text):
                        return
                    tags = lasting_tags(text)
                elif isinstance(item, Event):
                    self._raise(item)
                else:
                    self._carry_out(item)
        finally:
            self._service._movement.end()
            for future in self._started.values():
                future.cancel()

    def stop(self) -> None:
        """End it as soon as possible; returns at once."""
        self._stopped.set()
        current = self._current
        if current is not None:
            current.cancel()

    def finish(self, failure: Exception | None = None) -> None:
        """Answer the call, with what the text failed with."""
        if not self.answer.set_running_or_notify_cancel():
            return
        if failure is None:
            self.answer.set_result(None)
        else:
            self.answer.set_exception(failure)

    def _say(self, text: str) -> bool:
        """Say a piece; false when somebody made the robot fall silent."""
        service = self._service
        mode = self._mode or ("" if service._movement.isEnabled() else MODES[0])
        if mode != MODES[0]:
            service._movement.begin(spoken(text), mode)
        try:
            said = service._speech.speak(text)
            if said is None:
                return True
            self._await(said)
            return not said.cancelled() and bool(said.result())
        finally:
            service._movement.end()

    def _await(self, future: concurrent.futures.Future) -> None:
        self._current = future
        try:
            if self._stopped.is_set():
                future.cancel()
            concurrent.futures.wait([future])
        finally:
            self._current = None

    def _raise(self, event: Event) -> None:
        try:
            self._service._memory.raiseEvent(event.name, event.value)
        except ServiceError as error:
            log.warning("$%s: %s", event.name[:120], error)

    def _carry_out(self, instruction: Instruction) -> None:
        try:
            self._dispatch(instruction)
        except (ServiceError, ValueError, RuntimeError) as error:
            log.warning("^%s(%s): %s", instruction.name, instruction.text[:120], error)

    def _dispatch(self, instruction: Instruction) -> None:
        name, arguments = instruction.name, instruction.arguments
        if name == "mode":
            self._mode = one_of(arguments[0], MODES, "mode")
        elif name in ("call", "pCall"):
            self._call(instruction.text, wait=name == "call")
        elif name in _ACTIONS:
            self._act(name, instruction.text.strip(), "")
        elif name.endswith("Tag") and name[:-3] in _ACTIONS:
            *path, tag = arguments
            self._act_on_tag(name[:-3], tag, path[0] if path else "")
        elif name.endswith("Sound") and name[:-5] in _ACTIONS:
            self._sound(name[:-5], *arguments[:2])
        else:
            raise ServiceError("there is no such instruction")

    def _act(self, action: str, path: str, key: str) -> None:
        """Start, run, stop or wait for an animation, which is known as `key` or by its path."""
        animations = self._service._animations
        if action in ("start", "run"):
            found = animations.resolve(path)
            self._started[key or found] = animations.play(found)
        else:
            found = key or self._resolved(path)
        future = self._started.get(key or found)
        if future is None:
            return
        if action == "stop":
            future.cancel()
        elif action in ("run", "wait"):
            self._await(future)

    def _resolved(self, path: str) -> str:
        return path if path in self._started else self._service._animations.resolve(path)

    def _act_on_tag(self, action: str, tag: str, path: str) -> None:
        key = f"{path} {tag}"
        if action in ("start", "run"):
            self._act(action, self._service._animations.pick(tag, path), key)
        else:
            self._act(action, "", key)

    def _sound(self, action: str, sound: str, volume: str = "100") -> None:
        """Start, run, stop or wait for a sound of a sound set, "set/file"."""
        key = f"sound {sound}"
        if action in ("start", "run"):
            sound_set, _, file = sound.partition("/")
            loudness = min(max(float(volume), 0.0), 100.0) / 100.0
            self._started[key] = self._service._clients.start(
                "ALAudioPlayer", "playSoundSetFile", sound_set, file, 0.0, loudness, 0.0, False
            )
        future = self._started.get(key)
        if future is None:
            return
        if action == "stop":
            future.cancel()
        elif action in ("run", "wait"):
            self._await(future)

    def _call(self, text: str, *, wait: bool) -> None:
        service, method, arguments = parse_call(text)
        future = self._service._clients.start(service, method, *arguments)
        if wait:
            self._await(future)
