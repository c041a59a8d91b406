"""The program in which a behaviour with scripts runs: `python -m pepper_sim.animations.behavior_program FILE NAME`.

Its scripts find what Choregraphe's boxes use: a base class GeneratedClass with the box's outputs as methods, its
parameters, a logger, the session, and ALProxy. They are Python 3; what only Python 2 understands is translated as far
as this Python's lib2to3 can. QI_URL says where NAOqi answers.
"""

from __future__ import annotations

import inspect
import itertools
import logging
import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from typing import Any

from pepper_sim.animations.behavior import Box, read_behavior
from pepper_sim.animations.flow import Flow
from pepper_sim.animations.timeline import NotReadable, Timeline
from telepresence.naoqi import Session


class Proxy:
    """A service as ALProxy shows it: `post` and `pCall` return the number of a call that `wait` and `stop` know."""

    def __init__(self, session: Any, name: str) -> None:
        self._service = session.service(name)
        self._calls: dict[int, Any] = {}
        self._numbers = itertools.count(1)

    def __getattr__(self, method: str) -> Any:
        return getattr(self._service, method)

    @property
    def post(self) -> Any:
        """Every method of the service, called without waiting; returns a number."""
        return _Post(self)

    def pCall(self, method: str, *arguments: Any) -> int:
        """Call a method without waiting."""
        number = next(self._numbers)
        self._calls[number] = getattr(self._service, method)(*arguments, _async=True)
        return number

    def wait(self, number: int, timeout: int = 0) -> bool:
        """Wait for a call, at most `timeout` ms (0: without an end); whether it is still running."""
        call = self._calls.get(number)
        if call is None:
            return False
        if timeout:
            call.wait(timeout)
        else:
            call.wait()
        return bool(call.isRunning())

    def isRunning(self, number: int) -> bool:
        """Whether a call still runs."""
        call = self._calls.get(number)
        return call is not None and bool(call.isRunning())

    def stop(self, number: int) -> None:
        """End a call."""
        call = self._calls.pop(number, None)
        if call is not None and call.isRunning():
            call.cancel()


class _Post:
    def __init__(self, proxy: Proxy) -> None:
        self._proxy = proxy

    def __getattr__(self, method: str) -> Callable[..., int]:
        return lambda *arguments: self._proxy.pCall(method, *arguments)


class _FrameManager:
    """What boxes ask ALFrameManager: where their behaviour lies."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def getBehaviorPath(self, _: Any) -> str:
        """Return the behaviour's folder."""
        return str(self._folder)


class GeneratedClass:
    """Base of the classes in scripts; the box gives it its name, parameters and outputs."""

    box: Box
    emit: Callable[[str, Any], None]
    program: Program

    def __init__(self, *_: Any) -> None:
        self.logger = logging.getLogger(self.box.name)
        self.behaviorId = self.program.behavior
        self.packageUid = self.program.behavior.partition("/")[0]

    def __getattr__(self, name: str) -> Any:
        if name in {port.name for port in self.box.outputs.values()}:
            return lambda value=None: self.emit(name, value)
        raise AttributeError(f"the box '{self.box.name}' has no '{name}'")

    def onLoad(self) -> None:
        """The box is loaded."""

    def onUnload(self) -> None:
        """The box is unloaded."""

    def getName(self) -> str:
        """Return the name of the box."""
        return self.box.name

    def getParameter(self, name: str) -> Any:
        """Return a parameter of the box."""
        return self.program.parameters[id(self.box)][name]

    def setParameter(self, name: str, value: Any) -> None:
        """Change a parameter of the box."""
        self.program.parameters[id(self.box)][name] = value

    def log(self, text: Any) -> None:
        """Write a line to the log."""
        self.logger.info(text)

    def session(self) -> Any:
        """Return the session with NAOqi."""
        return self.program.session

    def behaviorAbsolutePath(self) -> str:
        """Return the behaviour's folder."""
        return str(self.program.folder)

    def packagePath(self) -> str:
        """Return the behaviour's folder."""
        return str(self.program.folder)


class _Script:
    """The object of one box's script. Each signal is handled on a thread of its own, in Choregraphe's way."""

    def __init__(self, program: Program, box: Box, emit: Callable[[str, Any], None]) -> None:
        self._program = program
        self._box = box
        base = type("GeneratedClass", (GeneratedClass,), {"box": box, "emit": staticmethod(emit), "program": program})
        scope: dict[str, Any] = {**program.names, "GeneratedClass": base, "__name__": box.name}
        exec(_compiled(box), scope)
        self._object = scope["MyClass"]()
        self._object.onLoad()

    def receive(self, name: str, value: Any) -> None:
        handler = getattr(self._object, f"onInput_{name}", None)
        if handler is not None:
            threading.Thread(target=self._call, args=(handler, value), name=self._box.name, daemon=True).start()

    def unload(self) -> None:
        self._object.onUnload()

    def _call(self, handler: Callable[..., Any], value: Any) -> None:
        try:
            handler(value) if _wants(handler, value) else handler()
        except Exception as error:  # of the user's code: it ends the behaviour, and its text is reported
            self._program.fail(self._box, error)


class Program:
    """The behaviour's stage: NAOqi, over a session."""

    def __init__(self, session: Any, file: Path, behavior: str) -> None:
        self.session = session
        self.folder = file.parent
        self.behavior = behavior
        self.error = ""
        root = read_behavior(file)
        self.parameters = {id(box): dict(box.parameters) for box in root.all()}
        self.names = {"ALProxy": self._proxy, "qi": sys.modules.get("qi")}
        self.flow = Flow(root, self)

    def run(self) -> None:
        """Run to the end."""
        self.flow.run()

    def fail(self, box: Box, error: BaseException) -> None:
        """End the behaviour because of an error in a box."""
        self.error = f"{box.name}: {type(error).__name__}: {' '.join(str(error).split())}"
        self.flow.stop()

    def play(self, timeline: Timeline) -> Future:
        """Start a timeline; see `Stage`."""
        done: Future = Future()
        if not timeline.curves:
            timer = threading.Timer(timeline.duration, _finish, [done])
            timer.daemon = True
            timer.start()
            return done
        names = list(timeline.curves)
        times = [[key.moment for key in timeline.curves[name]] for name in names]
        keys = [[[key.angle, [3, *key.left], [3, *key.right]] for key in timeline.curves[name]] for name in names]
        call = self.session.service("ALMotion").angleInterpolationBezier(names, times, keys, _async=True)
        call.addCallback(lambda _: _finish(done))
        done.add_done_callback(lambda future: call.cancel() if future.cancelled() else None)
        return done

    def load(self, box: Box, emit: Callable[[str, Any], None]) -> _Script:
        """Load a script; see `Stage`."""
        try:
            return _Script(self, box, emit)
        except Exception as error:
            raise NotReadable(f"{box.name}: {type(error).__name__}: {' '.join(str(error).split())}") from None

    def _proxy(self, name: str, *_: Any) -> Any:
        return _FrameManager(self.folder) if name == "ALFrameManager" else Proxy(self.session, name)


def _wants(handler: Callable[..., Any], value: Any) -> bool:
    """Whether an input's method takes the value: boxes have it with and without a parameter."""
    parameters = inspect.signature(handler).parameters.values()
    required = any(parameter.default is parameter.empty for parameter in parameters)
    return required or (bool(parameters) and value is not None)


def _compiled(box: Box) -> Any:
    try:
        return compile(box.script, box.name, "exec")
    except SyntaxError:
        return compile(_translated(box.script), box.name, "exec")


def _translated(script: str) -> str:
    """Translate Python 2 to 3; what cannot be translated stays as it is."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            from lib2to3.refactor import RefactoringTool, get_fixers_from_package
    except ImportError:  # Python 3.13 has no lib2to3 any more
        return script
    text = re.sub(r"^\t+", lambda tabs: " " * 4 * len(tabs.group()), script, flags=re.MULTILINE)
    return str(RefactoringTool(get_fixers_from_package("lib2to3.fixes")).refactor_string(text + "\n", "script"))


def _finish(future: Future) -> None:
    try:
        future.set_result(True)
    except InvalidStateError:
        pass  # it was cancelled


def main(arguments: list[str]) -> int:
    """Run a behaviour; 1 and a line on standard error, "box: error", if it fails."""
    logging.basicConfig(level=logging.INFO, stream=sys.stderr, format="%(name)s: %(message)s")
    session = Session()
    session.connect(os.environ["QI_URL"])
    try:
        program = Program(session, Path(arguments[0]), arguments[1])
        signal.signal(signal.SIGTERM, lambda *_: program.flow.stop())
        program.run()
    except NotReadable as error:
        print(error, file=sys.stderr)
        return 1
    if program.error:
        print(program.error, file=sys.stderr)
    return 1 if program.error else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
