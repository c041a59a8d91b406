"""An xterm with tmux, embedded in the window.

The terminal gets the keyboard by a click into it or by F6 and never on its own, the window by a click elsewhere; moving
the pointer changes nothing, because a held drive key must not end up as text in a terminal.
"""

from __future__ import annotations

import logging
import os
import queue
import shlex
import shutil
import subprocess
import threading
import time
from collections.abc import Callable

from PyQt5.QtCore import QEvent, QObject, QProcess, QProcessEnvironment, QSocketNotifier, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QGuiApplication, QHideEvent, QMouseEvent, QResizeEvent
from PyQt5.QtWidgets import QFrame, QStackedLayout, QWidget

from gui.application_events import filter_events
from gui.periodic_timer import PeriodicTimer
from gui.terminal.terminal_parts import TerminalParts
from gui.terminal.terminal_programs import TerminalPrograms
from gui.terminal.tmux import FIRST_WINDOW, Tmux, TmuxError, environment
from gui.terminal.x11 import HostWindow, X11Error
from gui.widgets.label import Label
from telepresence.station import vitals
from telepresence.station.restarts import Restarts

log = logging.getLogger(__name__)

FONT, FONT_SIZE = "DejaVu Sans Mono", 8.5
BACKGROUND, FOREGROUND, CURSOR = "#0d1116", "#d7dde6", "#4cc2ff"
PALETTE = (
    "#1b222c", "#f2555a", "#4cc38a", "#e2b340", "#5aa9f0", "#c58af9", "#46c8c8", "#c8d0db",
    "#5b6878", "#ff7a7e", "#6fdca4", "#f3cb6a", "#82c3ff", "#d9aefc", "#74e0e0", "#f2f5f9",
)  # fmt: skip
"""Colours 0 to 15 of the terminal."""

_LEAVE_KEY, _STOP_KEY = "F6", "Pause"
"""Keys that the programs in the terminal do not get."""
END_PATIENCE = 30.0
"""[s]: roslaunch gives its nodes 15 s after SIGINT and 2 s after SIGTERM, and then kills them."""
SEARCH_PERIOD = 50  # ms between two attempts to find xterm's window
WATCH_PERIOD = 200
"""[ms] between two looks whether a part of the terminal has died or was stopped."""
CLOSED = "The terminal was closed. Click here to open it again."
TERMINAL, REAPER, PROGRAM = "window terminal", "window terminal reaper", "window terminal program"
"""What is called so in faults: the terminal, what ends it together with the window, and what somebody runs in it."""


class TerminalView(QFrame):
    """The embedded terminal. `start` opens it; a thread of its own types lines into it."""

    ready = pyqtSignal()
    """xterm has opened its window, on the screen or in a tab behind another one."""
    refused = pyqtSignal(str)
    """A line could not be typed; why, and what to do."""
    typed = pyqtSignal(str)
    """A line has been typed."""
    busy = pyqtSignal(str)
    """Nothing was typed because a program runs; what was to be said then."""
    ended = pyqtSignal(str)
    """What `end_program` interrupted has ended: empty, or the program that still runs when patience is over."""
    focus_changed = pyqtSignal(bool)
    """Whether keys go to the terminal."""
    failed = pyqtSignal(str, str, str)
    """A part of the terminal has failed: what, what befell it and what comes next, in the words of a fault."""
    stop_typed = pyqtSignal()
    """Pause was pressed while keys go to the terminal: everything must stop."""

    def __init__(self, name: str = "", parent: QWidget | None = None) -> None:
        """`name` distinguishes it from other terminals of this process."""
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._tmux = Tmux(f"telepresence-{os.getpid()}" + (f"-{name}" if name else ""))
        self._xterm: QProcess | None = None
        self._parts: TerminalParts | None = None
        self._programs = TerminalPrograms()
        self._befallen = ""
        self._restarts = Restarts()
        self._reaper: subprocess.Popen | None = None
        self._host: HostWindow | None = None
        self._guest: int | None = None
        self._has_keyboard = self._is_ready = False
        self._wants_keyboard = False
        self._closing = False
        self._denied = ""
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._worker: threading.Thread | None = None

        self._container = QWidget()
        self._container.setAttribute(Qt.WidgetAttribute.WA_DontCreateNativeAncestors)
        self._container.setAttribute(Qt.WidgetAttribute.WA_NativeWindow)
        self._cover = _Cover()
        self._cover.clicked.connect(lambda: self.start(keyboard=True))
        self._layout = QStackedLayout(self)
        self._layout.addWidget(self._cover)
        self._layout.addWidget(self._container)
        self._search = PeriodicTimer(SEARCH_PERIOD, self._find_guest, self)
        self._watch = PeriodicTimer(WATCH_PERIOD, self._poll, self)
        kinds = (QEvent.Type.WindowActivate, QEvent.Type.WindowDeactivate, QEvent.Type.MouseButtonPress)
        filter_events(self, *kinds)

    @property
    def has_keyboard(self) -> bool:
        return self._has_keyboard

    def deny(self, reason: str) -> None:
        """Hide the terminal behind this sentence and let nobody type; an empty string shows it again. What runs in it
        keeps running."""
        self._denied = reason
        if reason:
            self.give_keyboard_back()
            self._wants_keyboard = False
            self._cover.say(reason)
            self._layout.setCurrentWidget(self._cover)
        elif self._xterm is not None:
            self._layout.setCurrentWidget(self._container)

    def start(self, keyboard: bool = False) -> None:
        """Open the terminal, or open it again after its shell has ended.

        Args:
            keyboard: Give it the keyboard as soon as it is open.
        """
        if self._xterm is not None or self._denied or self._closing:
            return
        if QGuiApplication.platformName() != "xcb":
            self._cover.say("The terminal needs an X11 display.")
            return
        missing = [program for program in ("xterm", "tmux") if shutil.which(program) is None]
        if missing:
            self._cover.say(f"The terminal needs {' and '.join(missing)}. Install with:  ./stack build")
            return
        self._layout.setCurrentWidget(self._container)
        try:
            self._host = HostWindow(int(self._container.winId()))
        except X11Error as error:
            self._cover.say(str(error))
            self._layout.setCurrentWidget(self._cover)
            return
        for key in (_LEAVE_KEY, _STOP_KEY):
            self._host.grab_key(key)
        self._clicks = QSocketNotifier(self._host.connection, QSocketNotifier.Type.Read, self)  # type: ignore[arg-type]
        self._clicks.activated.connect(self._on_x_event)
        self._wants_keyboard = keyboard
        self._reaper = self._reaper or self._tmux.start_reaper()
        self._xterm = QProcess(self)
        self._xterm.setProcessEnvironment(_process_environment())
        self._xterm.setProcessChannelMode(QProcess.ProcessChannelMode.ForwardedChannels)
        self._xterm.finished.connect(self._on_ended)
        program, *arguments = self._xterm_command()
        self._restarts.started(time.monotonic())
        self._xterm.start(program, arguments)
        self._is_ready = False
        self._parts, self._programs = TerminalParts(self._xterm.processId(), self._tmux.socket), TerminalPrograms()
        self._search.start()
        self._watch.start()

    def type_line(
        self, line: str | Callable[[], str], window: str = FIRST_WINDOW, otherwise: str | None = None
    ) -> None:
        """Type a line into a tmux window when its shell is at the prompt.

        Args:
            line: May be a function that returns the line: it runs on the typing thread, and its ValueError is reported
                by `refused`.
            otherwise: When a program runs in the window, emit `busy` with this sentence instead of `refused`.
        """

        def job() -> None:
            if otherwise is not None and self._tmux.program(window):
                self.busy.emit(otherwise)
                return
            text = line if isinstance(line, str) else line()
            self._tmux.type_line(window, text)
            self.typed.emit(text)

        self._do(job)

    def end_program(self, window: str = FIRST_WINDOW, patience: float = END_PATIENCE) -> None:
        """Interrupt what runs in a tmux window, and emit `ended` when its shell is at the prompt again, or after
        `patience` seconds. Lines that are to be typed next wait for that."""

        def job() -> None:
            left = window
            try:
                left = self._tmux.end_program(window, patience, given_up=lambda: self._closing)
            finally:
                self.ended.emit(left)

        self._do(job)

    def take_keyboard(self) -> None:
        """Give the keyboard to the terminal."""
        if self._denied:
            return
        self._wants_keyboard = True
        if self._host is None or self._guest is None:
            return
        self._wants_keyboard = False
        self.setFocus()  # so that no other widget shows a text cursor
        self._host.give_keyboard(self._guest)
        self._set_keyboard(True)

    def close_terminal(self) -> None:
        """End xterm, tmux and everything in it; takes a few seconds at most."""
        self._closing = True
        self._search.stop()
        self._watch.stop()
        if self._worker is not None:
            self._jobs.put(None)
            self._worker.join(timeout=6.0)
        if self._reaper is None:
            return
        assert self._reaper.stdin is not None  # `start_reaper` asks for a pipe
        self._reaper.stdin.close()
        if self._xterm is not None and not self._xterm.waitForFinished(2000):
            log.warning("xterm did not end with its tmux")
            self._xterm.kill()
            self._xterm.waitForFinished(1000)
        try:
            self._reaper.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            log.warning("tmux does not answer and was left behind")

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def hideEvent(self, event: QHideEvent) -> None:
        """Return the keyboard to the window: what is typed must not go where nobody sees it."""
        super().hideEvent(event)
        self.give_keyboard_back()

    def _xterm_command(self) -> list[str]:
        resources = [f"XTerm*color{index}: {colour}" for index, colour in enumerate(PALETTE)]
        # On-screen keyboards and assistive programs send events. Whatever could misuse this can type anyway (XTEST).
        resources.append("XTerm*allowSendEvents: true")
        command = ["xterm", "-into", str(int(self._container.winId())), "-tn", "xterm-256color"]
        command += ["-fa", FONT, "-fs", str(FONT_SIZE * self.devicePixelRatioF())]
        command += ["-bg", BACKGROUND, "-fg", FOREGROUND, "-cr", CURSOR]
        command += ["-b", "6", "-bw", "0", "+sb", "-geometry", "80x24+0+0"]
        for resource in resources:
            command += ["-xrm", resource]
        # xterm ends with 0 whatever became of what it ran.
        left = f'"$@" && : >{shlex.quote(str(self._tmux.left))}'
        return [*command, "-e", "sh", "-c", left, "terminal", *self._tmux.attach_command]

    def _find_guest(self) -> None:
        if self._host is None:
            return
        if not self._is_ready and self._host.has_guest():
            self._is_ready = True
            self.ready.emit()
        guest = self._host.guest()
        if guest is None:
            return
        self._search.stop()
        self._guest = guest
        self._fit()
        self._host.raise_shield()
        if self._wants_keyboard and self.isVisible() and self.isActiveWindow():
            self.take_keyboard()

    def _fit(self) -> None:
        if self._host is not None and self._guest is not None:
            ratio = self.devicePixelRatioF()
            size = self._container.size()
            self._host.fill(self._guest, round(size.width() * ratio), round(size.height() * ratio))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Track who has the keyboard. For Qt nothing changes, because a child of its window has the focus."""
        kind = event.type()
        if self._host is None or self._guest is None:
            return False
        if isinstance(watched, QWidget) and watched.window() is self.window():
            if kind == QEvent.Type.WindowActivate and self._wants_keyboard and self.isVisible():
                self.take_keyboard()
            elif kind in (QEvent.Type.WindowActivate, QEvent.Type.WindowDeactivate):
                self._host.raise_shield()
                self._set_keyboard(False)
            elif kind == QEvent.Type.MouseButtonPress:
                self.give_keyboard_back()
        return False

    def _on_x_event(self) -> None:
        happened = self._host.events() if self._host is not None else []
        if _STOP_KEY in happened:
            self.stop_typed.emit()
        if _LEAVE_KEY in happened:
            self.give_keyboard_back()
        elif "click" in happened:
            self.take_keyboard()

    def give_keyboard_back(self) -> None:
        """Give the keyboard to the window."""
        window = self.window()
        if self._has_keyboard and self._host is not None and window is not None:
            self._host.take_keyboard(int(window.winId()))
            self._set_keyboard(False)

    def _set_keyboard(self, has_keyboard: bool) -> None:
        if has_keyboard != self._has_keyboard:
            self._has_keyboard = has_keyboard
            self.focus_changed.emit(has_keyboard)

    def _poll(self) -> None:
        """Put another terminal in the place of one that was stopped, and so takes no keys."""
        if self._reaper is not None and (failure := vitals.failure(self._reaper)):
            self._reaper.kill()
            self._reaper.wait()
            self._reaper = self._tmux.start_reaper()
            self.failed.emit(REAPER, failure, "starts again")
        if self._parts is not None and not self._befallen and self._parts.stopped():
            self._befallen = "froze"
            self._parts.kill()
        elif self._parts is not None and self._parts.server:
            for what, then in self._programs.poll(self._parts.server):
                self.failed.emit(PROGRAM, what, then)

    def _on_ended(self) -> None:
        if self._closing:
            return
        # Nobody leaves a shell that waits for a program: it was killed.
        died = not self._tmux.was_left() or self._programs.running
        befallen, self._befallen, self._parts = self._befallen or "died", "", None
        self._search.stop()
        self._watch.stop()
        self._clicks.setEnabled(False)
        if self._host is not None:
            self._host.close()
        if self._xterm is not None:
            self._xterm.deleteLater()
        self._xterm = self._host = self._guest = None
        self._set_keyboard(False)
        if died:
            pause = self._restarts.died(time.monotonic())
            QTimer.singleShot(round(pause * 1000), self.start)
            self.failed.emit(TERMINAL, befallen, f"opens again in {pause:g} s" if pause else "opens again")
        self._cover.say(CLOSED)
        self._layout.setCurrentWidget(self._cover)

    def _do(self, job: Callable[[], None]) -> None:
        """Have the typing thread do it. A terminal into which nothing is typed has no such thread."""
        if self._worker is None:
            self._worker = threading.Thread(target=self._work, name="terminal-typing", daemon=True)
            self._worker.start()
        self._jobs.put(job)

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                job()
            except (TmuxError, ValueError) as error:
                self.refused.emit(str(error))
            except Exception:
                # One line that fails for whatever reason must not end the thread that types all later ones.
                log.exception("typing into the terminal failed")
                self.refused.emit("The line could not be typed. The window's log says why.")


class _Cover(Label):
    """What is shown while there is no terminal."""

    clicked = pyqtSignal()

    def __init__(self) -> None:
        super().__init__("")
        self.setObjectName("terminalCover")
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.setWordWrap(True)

    def say(self, text: str) -> None:
        self.setText(text)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.clicked.emit()
        event.accept()


def _process_environment() -> QProcessEnvironment:
    values = QProcessEnvironment()
    for name, value in environment().items():
        values.insert(name, value)
    return values
