"""The turns of a dialogue: sentences and events come in, one answer after the other is said and carried out.

While the robot speaks, sentences wait; an event waits as long as it is valid, and a blocking one interrupts the speech.
Source: NAOqi 2.8 documentation, ALDialog.
"""

from __future__ import annotations

import concurrent.futures
import datetime
import logging
import threading
import time
from collections.abc import Callable
from typing import Any

from pepper_sim.dialog.answers import call_of
from pepper_sim.dialog.conversation import FALLBACK, NOT_UNDERSTOOD, Conversation, Reaction
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.service import ServiceError
from pepper_sim.naoqi.tasks import Alarm, Workers
from pepper_sim.services.al_memory import ALMemory

log = logging.getLogger(__name__)

MAX_WAITING = 20
"""Sentences that wait for their turn."""
VALIDITY = 2.0
"""How long an event waits for its turn [s]."""
CALL_LIMIT = 30.0
"""How long a sentence waits for the result of ^call [s]."""
SILENCES = (5, 10, 15, 20)
"""Seconds without a word after which Dialog/NotSpeaking5 and so on are raised for the rules."""
OWN_EVENTS = frozenset(
    {f"{NOT_UNDERSTOOD}{number}" for number in ("", "2", "3")}
    | {f"Dialog/{name}" for name in ("Fallback", "Failure", "SpeakFailure", "SameRule")}
    | {f"Dialog/{name}{number}" for name in ("NotSpeaking", "NoOneSpeak") for number in ("", *SILENCES)}
)
"""Events for rules only, which never reach ALMemory."""
EVENTS = (
    *("Answered", "LastInput", "LastAnswer", "MatchedApp", "MatchedInput", "MatchedTopic", "MatchedLine"),
    *("CurrentString", "Tag", "Focus", "FocusDescription", "ActivateTopic", "DeactivateTopic", "OpenSession"),
    *("IsStarted", "MainDialogStarted", "NothingToSay", "NotUnderstoodEvent", "SaidMisunderstood", "Scope"),
)
"""Events of ALMemory, without "Dialog/"."""


class DialogTurns:
    """Takes the turns of one robot's conversation, on threads of `workers`.

    Args:
        say: Says a text and returns the future of its end, or None for an empty text.
        fall_silent: Stops the speech.
    Attributes:
        lock: Held while the conversation is used.
        answer_otherwise: Asked for an answer to what was not understood; "" if it has none.
    """

    def __init__(
        self,
        conversation: Conversation,
        memory: ALMemory,
        workers: Workers,
        alarm: Alarm,
        clients: ClientServices,
        say: Callable[[str], concurrent.futures.Future | None],
        fall_silent: Callable[[], None],
    ) -> None:
        self.lock = threading.RLock()
        self.answer_otherwise: Callable[[str], str] = lambda text: ""
        self.validities: dict[str, float] = {}
        """Event -> how long it waits [s]; negative: for ever."""
        self.blocking: set[str] = set()
        self.running = False
        self._conversation = conversation
        self._memory = memory
        self._workers = workers
        self._alarm = alarm
        self._clients = clients
        self._say = say
        self._fall_silent = fall_silent
        self._turn = threading.Lock()
        self._waiting = 0
        self._pending: set[str] = set()
        self._raised: dict[str, float] = {}
        self._followed: dict[str, Callable[[], None]] = {}
        self._silence = 0
        memory.declare(f"Dialog/{name}" for name in EVENTS)

    def ask(self, find: Callable[[], Reaction | None]) -> concurrent.futures.Future:
        """Find a reaction with `find` when it is its turn, and carry it out; the future ends with the answer.

        Raises: ServiceError: Too many sentences wait.
        """
        return self._take(lambda: self._locked(find))

    def sentence(self, text: str) -> concurrent.futures.Future:
        """Answer what a human says; see `ask`."""
        return self._take(lambda: self._understand(text))

    def follow(self) -> None:
        """Follow the events that the active topics wait for, and no others."""
        with self.lock:
            wanted = self._conversation.events - OWN_EVENTS
            for event in set(self._followed) - wanted:
                self._followed.pop(event)()
            for event in wanted - set(self._followed):
                self._followed[event] = self._memory.follow(event, self._raise(event))

    def event(self, event: str) -> None:
        """Answer an event. One that waits already is dropped."""
        with self.lock:
            self._raised[event] = time.monotonic()
            if not self.running or event in self._pending or self._waiting >= MAX_WAITING:
                return
            self._pending.add(event)
        if event in self.blocking:
            self._fall_silent()
        since = time.monotonic()
        self._take(lambda: self._notice(event, since))

    def _raise(self, event: str) -> Callable[[Any], None]:
        return lambda _: self.event(event)

    def close(self) -> None:
        with self.lock:
            for end in self._followed.values():
                end()
            self._followed.clear()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _take(self, work: Callable[[], Reaction | None]) -> concurrent.futures.Future:
        with self.lock:
            if self._waiting >= MAX_WAITING:
                raise ServiceError(f"{MAX_WAITING} sentences wait for an answer already")
            self._waiting += 1
        future = self._workers.run(self._one, work)
        future.add_done_callback(self._no_longer_waiting)
        return future

    def _no_longer_waiting(self, _: concurrent.futures.Future) -> None:
        with self.lock:
            self._waiting -= 1

    def _locked(self, find: Callable[[], Reaction | None]) -> Reaction | None:
        with self.lock:
            return find()

    def _one(self, work: Callable[[], Reaction | None]) -> None:
        with self._turn:
            self._silence += 1
            self._store_moment()
            reaction = work()
            if reaction is not None:
                self._carry_out(reaction)
        self._wait_for_silence()

    def _understand(self, text: str) -> Reaction | None:
        self._memory.store("Dialog/CurrentString", text)
        self._memory.announce("Dialog/LastInput", text)
        now = time.monotonic()
        recent = [event for event, raised in self._raised.items() if self._valid(event, raised, now)]
        focus = self._conversation.focus
        with self.lock:
            reaction = self._conversation.react(text, recent)
        if reaction is None or not reaction.understood:
            self._memory.announce("Dialog/SaidMisunderstood", text)
            other = self.answer_otherwise(text)
            if other:
                self._speak(other)
                return None
            if reaction is not None:
                self._memory.announce("Dialog/NotUnderstoodEvent", text)
        elif reaction.rule is not None:
            self._report_match(reaction, focus)
        return reaction

    def _report_match(self, reaction: Reaction, focus: str) -> None:
        rule = reaction.rule
        if rule is None:
            return
        self._memory.store("Dialog/MatchedApp", "")
        self._memory.announce("Dialog/MatchedTopic", rule.topic)
        self._memory.announce("Dialog/MatchedInput", rule.source)
        self._memory.announce("Dialog/MatchedLine", str(rule.line))
        holder = self._conversation.topic(focus)
        if holder is not None and "keepFocus" in holder.properties and rule.topic != focus:
            self.event(FALLBACK)

    def _notice(self, event: str, since: float) -> Reaction | None:
        with self.lock:
            self._pending.discard(event)
            valid = self._valid(event, since, time.monotonic())
            return self._conversation.react_to_event(event) if valid else None

    def _valid(self, event: str, since: float, now: float) -> bool:
        validity = self.validities.get(event, VALIDITY)
        return validity < 0.0 or now - since <= validity

    def _carry_out(self, reaction: Reaction) -> None:
        """Say an answer and do what it causes. Called in a turn, without the lock."""
        said, reactions = reaction.answer.text, [reaction]
        for effect in reaction.answer.effects:
            if effect.kind in ("call", "sCall", "pCall"):
                result = self._call(str(effect.arguments[0]), wait=effect.kind != "pCall")
                if effect.kind == "call" and reaction.rule is not None:
                    with self.lock:
                        after = self._conversation.react_to_result(reaction.rule, result)
                    if after is not None:
                        reactions.append(after)
                        said = f"{said} {after.answer.text}".strip()
            elif effect.kind == "switchFocus":
                self._call(f'ALAutonomousLife.switchFocus("{effect.arguments[0]}")', wait=False)
        if self._conversation.pushing and reaction.match is not None:
            with self.lock:
                pushed = self._conversation.propose()
            if pushed is not None:
                reactions.append(pushed)
                said = f"{said} {pushed.answer.text}".strip()
        for tag in (tag for each in reactions for tag in each.answer.tags):
            self._memory.announce("Dialog/Tag", tag)
        self._speak(said, understood=reaction.understood)
        self._settle(reactions)

    def _speak(self, text: str, understood: bool = True) -> None:
        if not text:
            return
        future = self._say(text)
        self._memory.announce("Dialog/Answered", text)
        if understood:
            self._memory.announce("Dialog/LastAnswer", text)
        if future is not None:
            self._workers.wait_until(future.done)

    def _settle(self, reactions: list[Reaction]) -> None:
        with self.lock:
            focus, scope = self._conversation.focus, self._conversation.in_scope
            for reaction in reactions:
                self._conversation.settle(reaction)
            new_focus, new_scope = self._conversation.focus, self._conversation.in_scope
        if new_focus != focus:
            self.report_focus()
        if new_scope != scope:
            self._memory.announce("Dialog/Scope", int(new_scope))

    def report_focus(self) -> None:
        """Raise the events of a new focus."""
        topic = self._conversation.topic(self._conversation.focus)
        self._memory.announce("Dialog/Focus", self._conversation.focus)
        self._memory.announce("Dialog/FocusDescription", topic.description if topic is not None else "")

    def _call(self, text: str, wait: bool) -> str | None:
        """Call a method, "ALMotion.rest()"; return its result as text, None if it failed."""
        call = call_of(text)
        if call is None:
            log.warning("a rule cannot call %r", text[:80])
            return None
        service, method, arguments = call
        try:
            answer = self._clients.start(service, method, *arguments)
        except RuntimeError as error:
            log.warning("a rule's call failed: %s", error)
            return None
        if not wait:
            return ""
        try:
            self._workers.wait_until(answer.done, CALL_LIMIT)
            return as_text(answer.result(0.0)) or ""
        except (RuntimeError, TimeoutError, ValueError, concurrent.futures.CancelledError) as error:
            log.warning("a rule's call of %s.%s failed: %s", service, method, error)
            return None

    def _store_moment(self) -> None:
        now = datetime.datetime.now()
        hour = now.hour
        for name, value in (
            ("Year", f"{now:%Y}"),
            ("Hour", str(hour)),
            ("Minute", str(now.minute)),
            ("Second", str(now.second)),
            ("DateCode", f"{now:%m%d}"),
            ("Morning", int(5 <= hour < 11)),
            ("Default", int(11 <= hour < 19)),
            ("Night", int(hour >= 19 or hour < 5)),
        ):
            self._memory.store(f"Dialog/{name}", value)

    def _wait_for_silence(self) -> None:
        """Raise the events of silence for the rules that wait for them."""
        with self.lock:
            wanted = self._conversation.events & OWN_EVENTS
            number = self._silence
        for seconds in SILENCES if self.running else ():
            for name in ("Dialog/NotSpeaking", "Dialog/NoOneSpeak"):
                for event in (f"{name}{seconds}", name) if seconds == SILENCES[-1] else (f"{name}{seconds}",):
                    if event in wanted:
                        self._alarm.after(float(seconds)).add_done_callback(self._silent(event, number))

    def _silent(self, event: str, number: int) -> Callable[[concurrent.futures.Future], None]:
        def over(_: concurrent.futures.Future) -> None:
            if self._silence == number and not self._workers.closing.is_set():
                self.event(event)

        return over


def as_text(value: Any) -> str | None:
    """Return a value of ALMemory, or an answer of a service, as a rule compares and says it."""
    if value is None or value == "":
        return None
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list | tuple):
        return " ".join(text for item in value if (text := as_text(item)) is not None) or None
    return str(value)
