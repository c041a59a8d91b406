"""The interface of the vendor's package `qi`: what it does without a robot, ours must do as well."""

from __future__ import annotations

import importlib
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

import telepresence.naoqi as ours
from telepresence.naoqi.workers import Workers

MS = 20_000
"""Milliseconds after which something counts as never coming."""

LEFT_OUT = {"Translator", "defaultTranslator", "listModules", "module", "path", "tr"}


def outcome(function: Callable[[], Any]) -> Any:
    """Return what a function returns, or the first line of its RuntimeError."""
    try:
        return function()
    except RuntimeError as error:
        return f"! {str(error).splitlines()[0]}"


def promised(qi: Any, act: Callable[[Any], Any]) -> Any:
    promise = qi.Promise()
    act(promise)
    return promise.future()


# --- futures ---------------------------------------------------------------------------------------------------------

ENDS = {
    "value": (lambda promise: promise.setValue(3), (3, "! Future has no error.", True, False, False, 4)),
    "error": (lambda promise: promise.setError("bad"), ("! bad", "bad", False, True, False, 3)),
    "cancel": (
        lambda promise: promise.setCanceled(),
        ("! Future canceled.", "! Future has no error.", False, False, True, 2),
    ),
}


@pytest.mark.parametrize("end", ENDS)
def test_how_a_future_ends(qi: Any, end: str) -> None:
    act, expected = ENDS[end]
    future = promised(qi, act)
    seen = (
        outcome(future.value),
        outcome(future.error),
        future.hasValue(),
        future.hasError(),
        future.isCanceled(),
        int(future.wait()),
    )
    assert seen == expected
    assert future.isFinished() and not future.isRunning()


@pytest.mark.parametrize("act", [end[0] for end in ENDS.values()], ids=ENDS)
def test_a_promise_is_kept_once(qi: Any, act: Callable[[Any], Any]) -> None:
    promise = qi.Promise()
    promise.setValue(1)
    assert outcome(lambda: act(promise)) == "! Future has already been set."


def test_waiting_for_a_future_has_an_end(qi: Any) -> None:
    promise = qi.Promise()
    future = promise.future()
    asked = [outcome(lambda ask=ask: ask(10)) for ask in (future.value, future.error, future.hasValue, future.hasError)]
    assert asked == ["! Future timeout."] * 4
    assert future.wait(10) == qi.FutureState.Running and future.isRunning()


def test_a_promise_that_nobody_can_keep(qi: Any) -> None:
    future = qi.Promise().future()
    assert outcome(lambda: future.value(MS)) == "! Promise broken (all promises are destroyed)"


def test_a_cancel_is_a_request(qi: Any) -> None:
    promise = qi.Promise()
    promise.future().cancel()
    assert promise.isCancelRequested() and promise.future().isRunning()
    promise.setValue(1)
    assert promise.future().value() == 1

    obliging = qi.Promise(lambda asked: asked.setCanceled())
    obliging.future().cancel()
    assert obliging.future().isCanceled()

    failing = qi.Promise(lambda asked: 1 / 0)
    failing.future().cancel()  # logged, not raised
    assert failing.future().isRunning()


def test_what_follows_a_future(qi: Any) -> None:
    error = promised(qi, lambda promise: promise.setError("bad"))
    canceled = promised(qi, lambda promise: promise.setCanceled())
    five = qi.Future(5)
    results = [
        five.then(lambda done: (type(done) is qi.Future, done.value())),
        five.andThen(lambda value: value + 1),
        five.then(lambda done: 1 / 0),
        five.andThen(lambda value: 1 / 0),
        error.then(lambda done: done.error()),
        error.andThen(lambda value: value),
        canceled.then(lambda done: done.isCanceled()),
        canceled.andThen(lambda value: value),
        five.then(lambda done: qi.Future(9)).unwrap(),
    ]
    assert [outcome(lambda result=result: result.value(MS)) for result in results] == [
        (True, 5),
        6,
        "! ZeroDivisionError: division by zero",
        "! ZeroDivisionError: division by zero",
        "bad",
        "! bad",
        True,
        "! Future canceled.",
        9,
    ]


def test_callbacks_of_a_future_run_elsewhere(qi: Any) -> None:
    seen: queue.Queue = queue.Queue()
    promise = qi.Promise()
    promise.future().addCallback(lambda done: seen.put((done.value(), threading.get_ident())))
    promise.future().addCallback(lambda done: 1 / 0)  # costs nobody anything
    promise.setValue("early")
    promise.future().addCallback(lambda done: seen.put((done.value(), threading.get_ident())))
    for _ in range(2):
        value, thread = seen.get(timeout=MS / 1000)
        assert value == "early" and thread != threading.get_ident()


def test_a_barrier_waits_for_all(qi: Any) -> None:
    promise = qi.Promise()
    barrier = qi.futureBarrier([qi.Future(1), promise.future()])
    assert barrier.wait(10) == qi.FutureState.Running
    promise.setError("bad")
    assert [future.hasError() for future in barrier.value(MS)] == [False, True]
    assert qi.futureBarrier([]).value(MS) == []


def test_functions_run_later(qi: Any) -> None:
    def add(one: int, other: int = 1) -> int:
        return one + other

    assert qi.runAsync(add, 4).value(MS) == 5
    assert qi.runAsync(add, 4, other=3, delay=1000).value(MS) == 7
    assert outcome(lambda: qi.runAsync(lambda: 1 / 0).value(MS)) == "! ZeroDivisionError: division by zero"
    waiting = qi.runAsync(add, 4, delay=3_600_000_000)
    waiting.cancel()
    assert waiting.wait(MS) == qi.FutureState.Canceled


def test_a_periodic_task(qi: Any) -> None:
    task, calls = qi.PeriodicTask(), queue.Queue()
    refused = "! Periodic task cannot start without a "
    assert outcome(lambda: task.start(True)) == refused + "setCallback() call first"
    task.setCallback(lambda: calls.put(threading.get_ident()))
    assert outcome(lambda: task.start(True)) == refused + "setPeriod() call first"
    assert outcome(lambda: task.setUsPeriod(-1)) == "! Period cannot be negative"
    task.setUsPeriod(1000)
    task.start(True)
    for _ in range(3):
        assert calls.get(timeout=MS / 1000) != threading.get_ident()
    assert task.isRunning()
    task.stop()
    assert not task.isRunning()
    while not calls.empty():
        calls.get()
    time.sleep(0.02)  # twenty periods
    assert calls.empty()


# --- signals and properties ------------------------------------------------------------------------------------------


def test_a_signal(qi: Any) -> None:
    seen: queue.Queue = queue.Queue()
    first_and_last: list[bool] = []
    signal = qi.Signal("(is)", first_and_last.append)
    link = signal.connect(lambda *args: seen.put((args, threading.get_ident())))
    failing = signal.connect(lambda *args: 1 / 0)
    signal(3, "a")
    args, thread = seen.get(timeout=MS / 1000)
    assert args == (3, "a") and thread != threading.get_ident()
    assert [signal.disconnect(link), signal.disconnect(link), signal.disconnect(failing)] == [True, False, True]
    assert first_and_last == [True, False]
    signal(4, "b")
    assert seen.empty()
    assert signal.connect(print, _async=True).value(MS) > 0
    assert signal.disconnectAll() is True
    with pytest.raises(TypeError):
        signal.connect(3)


def test_a_property(qi: Any) -> None:
    seen: queue.Queue = queue.Queue()
    prop = qi.Property("i")
    assert prop.value() == 0
    prop.connect(seen.put)
    prop.setValue(2.5)
    assert prop.value() == 2 and seen.get(timeout=MS / 1000) == 2
    assert outcome(lambda: prop.setValue("abc")).startswith("! ")
    assert prop.value() == 2
    assert prop.setValue(7, _async=True).value(MS) is None
    assert prop.value(_async=True).value(MS) == 7
    assert [qi.Property(signature).value() for signature in ("f", "s", "[i]", "(is)")] == [0.0, "", [], (0, "")]


@pytest.mark.parametrize("make", ["Signal", "Property"])
def test_a_type_that_is_none(qi: Any, make: str) -> None:
    assert outcome(lambda: getattr(qi, make)("q")).startswith("! Invalid signature")


@pytest.mark.parametrize("kind", ["default", "single", "multi"])
def test_methods_of_one_object_take_turns(qi: Any, kind: str) -> None:
    """Whoever calls them back: signals, futures, runAsync. Those of a multiThreaded class do not."""
    meeting = threading.Barrier(2)
    running: list[int] = []
    most: queue.Queue = queue.Queue()

    class Worker:
        def work(self, *_: Any) -> None:
            running.append(1)
            most.put(len(running))
            if kind == "multi":
                meeting.wait(MS / 1000)  # another one is here, too
            else:
                time.sleep(0.003)
            running.pop()

    if kind != "default":
        Worker = {"single": qi.singleThreaded, "multi": qi.multiThreaded}[kind]()(Worker)
    worker, signals = Worker(), [qi.Signal(), qi.Signal()]
    for signal in signals:
        signal.connect(worker.work)
    qi.runAsync(worker.work)
    qi.Future(1).addCallback(worker.work)
    for signal in signals:
        signal()
    counts = [most.get(timeout=MS / 1000) for _ in range(4)]
    assert max(counts) >= 2 if kind == "multi" else max(counts) == 1


# --- names -----------------------------------------------------------------------------------------------------------


@pytest.mark.vendor
def test_every_name_of_the_vendors_package_is_here() -> None:
    vendors = importlib.import_module("qi")
    missing = [name for name in vendors.__all__ if name not in LEFT_OUT and not hasattr(ours, name)]
    assert missing == []
    for name in ("Int8", "UInt64", "Float", "Buffer", "AnyArguments", "Void"):
        one, other = getattr(vendors, name), getattr(ours, name)
        assert str(one) == str(other) == str(other()) and other == other()
    nested = [module.Map(module.String, module.List(module.Optional(module.Int32))) for module in (vendors, ours)]
    assert str(nested[1]) == nested[0].signature == "{s[+i]}"
    for name in ("Future", "Promise", "Signal", "Property", "PeriodicTask"):
        expected = {member for member in dir(getattr(vendors, name)) if not member.startswith("_")}
        assert expected <= set(dir(getattr(ours, name)))
    members = {name for name in dir(vendors.Session()) if not name.startswith("_")}
    # Those of every vendor's object, of which a session is one.
    assert members - set(dir(ours.Session)) - set(dir(ours.Session())) == {"async", "call", "isValid", "metaObject"}


@pytest.mark.parametrize("name", sorted(LEFT_OUT - {"path"}))
def test_what_is_left_out_says_so_and_is_listed(name: str) -> None:
    with pytest.raises(RuntimeError, match=rf"^{name} is not offered"):
        getattr(ours, name)("x")
    assert name in (ours.__doc__ or "") or name == "Translator"


def test_the_path_functions_are_left_out() -> None:
    with pytest.raises(RuntimeError, match=r"^path is not offered"):
        _ = ours.path
    with pytest.raises(RuntimeError, match="modules cannot be loaded"):
        ours.Session().loadServiceRename("a", "b", "c")


SERVICE = """
class Service:
    "What it does."
    def __init__(self):
        self.emitted = qi.Signal("(is)")
        self.value = qi.Property("i")
        self.anything = qi.Signal()
    def plain(self, a, b=2):
        "Says so."
    def star(self, *a): pass
    def _private(self): pass
    @qi.nobind
    def hidden(self): pass
    @qi.bind(qi.Int32, (qi.Int32, qi.String), "renamed")
    def typed(self, a, b): pass
    @qi.bind(qi.Void, qi.AnyArguments)
    def all(self, *a): pass
    @staticmethod
    def static(a): pass
    @classmethod
    def of_class(cls, a): pass
    attribute = 5
    def keywords(self, **k): pass
"""


def test_the_members_of_an_object_of_ones_own(qi: Any) -> None:
    scope = {"qi": qi}
    exec(SERVICE, scope)
    session = qi.Session()
    session.listenStandalone("tcp://127.0.0.1:0")
    try:
        session.registerService("Service", scope["Service"]())
        meta = session.service("Service").metaObject()
    finally:
        session.close()
    texts = ("name", "parametersSignature", "returnSignature")
    methods = {uid: tuple(one[text] for text in texts) for uid, one in meta["methods"].items()}
    assert {uid: method for uid, method in methods.items() if uid >= 100} == {
        100: ("_private", "()", "m"),
        101: ("all", "m", "v"),
        104: ("keywords", "()", "m"),
        105: ("of_class", "(m)", "m"),
        106: ("plain", "(mm)", "m"),
        107: ("star", "m", "m"),
        108: ("static", "(m)", "m"),
        109: ("renamed", "(is)", "i"),
    }
    own = {uid: (one["name"], one["signature"]) for uid, one in meta["signals"].items() if uid >= 100}
    assert own == {102: ("anything", "m"), 103: ("emitted", "(is)"), 110: ("value", "(i)")}
    assert {uid: one["signature"] for uid, one in meta["properties"].items()} == {110: "i"}
    assert meta["methods"][106]["description"] == "Says so."


# --- programs --------------------------------------------------------------------------------------------------------

SCRIPT = """
import sys
import qi
app = qi.Application(["name", "--qi-url=" + sys.argv[1], "--mine"])
app.start()
memory = app.session.service("Memory")
try:
    memory.getData("nothing")
except RuntimeError as error:
    print(str(error).splitlines()[0])
print(memory.getData("key"), memory.getData("key", _async=True).value(), app.url == sys.argv[1])
app.session.serviceRegistered.connect(lambda number, name: app.stop())
app.session.service("Memory").announce(_async=True)
app.run()
print("ran")
"""
AS_QI = "import sys, telepresence.naoqi; sys.modules['qi'] = telepresence.naoqi; sys.argv[1:] = [{url!r}]\n"


class Memory:
    def __init__(self, session: ours.Session) -> None:
        self.session = session

    def getData(self, key: str) -> float:
        return {"key": 2.5}[key]

    def announce(self) -> None:
        self.session.registerService("Later", Memory(self.session))


@pytest.fixture
def robot() -> Any:
    session = ours.Session()
    session.listenStandalone("tcp://127.0.0.1:0")
    session.registerService("Memory", Memory(session))
    yield session
    session.close()


def run(program: str, *arguments: str) -> tuple[str, str]:
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=60, check=True
    )
    return done.stdout, done.stderr


def test_a_script_for_the_vendors_package_runs_unchanged(robot: Any) -> None:
    output, errors = run(AS_QI.format(url=robot.url()) + SCRIPT)
    assert output.splitlines() == ["KeyError: 'nothing'", "2.5 2.5 True", "ran"]
    assert errors == ""


@pytest.mark.vendor
def test_the_vendors_package_says_the_same_to_the_same_script(robot: Any) -> None:
    output, _ = run(SCRIPT, robot.url())
    said = [line for line in output.splitlines() if not line.startswith("[")]  # libqi logs to standard output
    assert said == ["KeyError: 'nothing'", "2.5 2.5 True", "ran"]


LEAVES = """
import os, sys, time
import telepresence.naoqi as qi
session = qi.Session()
session.connect(sys.argv[1])
memory = session.service("Memory")
class Own:
    def block(self):
        time.sleep(3600)
session.registerService("Own", Own())
session.service("Own").block(_async=True)          # a callback that never ends
qi.runAsync(time.sleep, 3600)
session.serviceUnregistered.connect(print)
if sys.argv[2] == "fork":
    child = os.fork()
    if child == 0:
        assert not session.isConnected()
        session.connect(sys.argv[1])                # the child has connections of its own
        print(session.service("Memory").getData("key"), flush=True)
        session.close()
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    print(memory.getData("key"))                    # and leaves the parent's alone
"""


@pytest.mark.parametrize("how", ["fork", "exit"])
def test_a_program_ends_whatever_runs_and_says_nothing(robot: Any, how: str) -> None:
    assert run(LEAVES, robot.url(), how) == ("2.5\n2.5\n" if how == "fork" else "", "")


def test_work_without_a_new_thread_waits_for_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """As at the end of a program under Python 3.12, where no thread starts any more: nothing is raised."""
    done: queue.Queue = queue.Queue()
    pool = Workers()

    def refuse(thread: threading.Thread) -> None:
        raise RuntimeError("can't create new thread at interpreter shutdown")

    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", refuse)
        pool.submit(done.put, 1)
    pool.submit(done.put, 2)
    assert [done.get(timeout=MS / 1000) for _ in range(2)] == [1, 2]
