"""The few X11 requests for another program's window that Qt 5 does not offer.

They are made on a connection of their own (libX11 through ctypes), on the caller's thread. The other program may end at
any moment, so its windows may be gone when a request arrives: such errors are expected and ignored.
"""

from __future__ import annotations

import ctypes
import os
import time
from ctypes import POINTER, byref, c_char_p, c_int, c_long, c_uint, c_ulong, c_void_p

# X11/X.h
_INPUT_ONLY = 2
_REVERT_TO_PARENT = 2
_CURRENT_TIME = 0
_BUTTON_PRESS_MASK = 1 << 2
_BUTTON_PRESS = 4
_KEY_PRESS = 2
_ANY_MODIFIER = 1 << 15
_GRAB_ASYNC = 1
_IS_VIEWABLE = 2


class _Attributes(ctypes.Structure):
    """XWindowAttributes of X11/Xlib.h: the fields that are read here, and room for the others."""

    _fields_ = (
        ("x", c_int),
        ("y", c_int),
        ("width", c_int),
        ("height", c_int),
        ("border_width", c_int),
        ("depth", c_int),
        ("visual", c_void_p),
        ("root", c_ulong),
        ("window_class", c_int),
        ("bit_gravity", c_int),
        ("win_gravity", c_int),
        ("backing_store", c_int),
        ("backing_planes", c_ulong),
        ("backing_pixel", c_ulong),
        ("save_under", c_int),
        ("colormap", c_ulong),
        ("map_installed", c_int),
        ("map_state", c_int),
        ("rest", c_long * 8),
    )


class _KeyEvent(ctypes.Structure):
    """XKeyEvent of X11/Xlib.h."""

    _fields_ = (
        ("kind", c_int),
        ("serial", c_ulong),
        ("send_event", c_int),
        ("display", c_void_p),
        ("window", c_ulong),
        ("root", c_ulong),
        ("subwindow", c_ulong),
        ("time", c_ulong),
        ("places", c_int * 4),
        ("state", c_uint),
        ("keycode", c_uint),
        ("same_screen", c_int),
    )


class _Event(ctypes.Union):
    _fields_ = (("kind", c_int), ("key", _KeyEvent), ("room", c_long * 24))  # XEvent: long pad[24]


_ErrorHandler = ctypes.CFUNCTYPE(c_int, c_void_p, c_void_p)
_ignore_errors = _ErrorHandler(lambda display, error: 0)


def _library() -> ctypes.CDLL:
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XOpenDisplay.argtypes, x11.XOpenDisplay.restype = [c_char_p], c_void_p
    x11.XCloseDisplay.argtypes = [c_void_p]
    x11.XConnectionNumber.argtypes = [c_void_p]
    x11.XDefaultScreen.argtypes = [c_void_p]
    x11.XDisplayWidth.argtypes = x11.XDisplayHeight.argtypes = [c_void_p, c_int]
    x11.XSetErrorHandler.argtypes, x11.XSetErrorHandler.restype = [_ErrorHandler], c_void_p
    x11.XSync.argtypes = [c_void_p, c_int]
    x11.XPending.argtypes = [c_void_p]
    x11.XNextEvent.argtypes = [c_void_p, POINTER(_Event)]
    x11.XFree.argtypes = [c_void_p]
    x11.XQueryTree.argtypes = [
        c_void_p, c_ulong, POINTER(c_ulong), POINTER(c_ulong), POINTER(POINTER(c_ulong)), POINTER(c_uint),
    ]  # fmt: skip
    x11.XGetWindowAttributes.argtypes = [c_void_p, c_ulong, POINTER(_Attributes)]
    x11.XMoveResizeWindow.argtypes = [c_void_p, c_ulong, c_int, c_int, c_uint, c_uint]
    x11.XSetInputFocus.argtypes = [c_void_p, c_ulong, c_int, c_ulong]
    x11.XCreateWindow.argtypes = [
        c_void_p, c_ulong, c_int, c_int, c_uint, c_uint, c_uint, c_int, c_uint, c_void_p, c_ulong, c_void_p,
    ]  # fmt: skip
    x11.XCreateWindow.restype = c_ulong
    x11.XStringToKeysym.argtypes, x11.XStringToKeysym.restype = [c_char_p], c_ulong
    x11.XKeysymToKeycode.argtypes, x11.XKeysymToKeycode.restype = [c_void_p, c_ulong], ctypes.c_ubyte
    x11.XGrabKey.argtypes = [c_void_p, c_int, c_uint, c_ulong, c_int, c_int, c_int]
    for name in ("XMapRaised", "XUnmapWindow"):
        getattr(x11, name).argtypes = [c_void_p, c_ulong]
    x11.XSelectInput.argtypes = [c_void_p, c_ulong, c_long]
    return x11


class X11Error(RuntimeError):
    """The X server cannot be reached."""


def hold_display(name: str, patience: float = 1.0) -> bool:
    """Whether the X server at this value of DISPLAY accepts a connection within `patience` seconds.

    The connection is never closed: a server that loses its last client may reset itself, and would meanwhile refuse the
    next one, which is Qt. For the same reason a refused connection is tried again.
    """
    try:
        x11 = _library()
    except OSError:
        return False
    deadline = time.monotonic() + patience
    while not x11.XOpenDisplay(name.encode()):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def screen_size(name: str) -> tuple[int, int]:
    """Return width and height of the X screen at this value of DISPLAY, all its monitors together [px]; zeros when they
    are unknown."""
    try:
        x11 = _library()
    except OSError:
        return 0, 0
    display = x11.XOpenDisplay(name.encode())
    if not display:
        return 0, 0
    try:
        screen = x11.XDefaultScreen(display)
        return x11.XDisplayWidth(display, screen), x11.XDisplayHeight(display, screen)
    finally:
        x11.XCloseDisplay(display)


class HostWindow:
    """A window of this process in which another program, the guest, opens its own window.

    Args:
        window: The X window of this process.
    Raises:
        X11Error: The X server cannot be reached.
    """

    def __init__(self, window: int) -> None:
        try:
            self._x11 = _library()
        except OSError as error:
            raise X11Error(f"libX11 cannot be loaded: {error}") from error
        self._x11.XSetErrorHandler(_ignore_errors)
        self._display = self._x11.XOpenDisplay(None)
        if not self._display:
            raise X11Error(f"no X server answers at DISPLAY={os.environ.get('DISPLAY', '')!r}")
        self._window = window
        # An invisible child on top of the guest: while it is mapped, the guest gets neither clicks nor keys typed while
        # the pointer is over it (X11 protocol, "keyboard focus": key events go to the window under the pointer if that
        # is inside the focus window).
        self._shield = self._x11.XCreateWindow(self._display, window, 0, 0, 1, 1, 0, 0, _INPUT_ONLY, None, 0, None)
        self._x11.XSelectInput(self._display, self._shield, _BUTTON_PRESS_MASK)
        self._keys: dict[int, str] = {}
        self._sync()

    @property
    def connection(self) -> int:
        """The file descriptor that becomes readable when there are `events`."""
        return self._x11.XConnectionNumber(self._display)

    def guest(self) -> int | None:
        """Return the guest's window; None until it is on the screen."""
        return next(filter(self._is_viewable, self._guests()), None)

    def has_guest(self) -> bool:
        """Whether there is a guest, on the screen or in a tab behind another one."""
        return bool(self._guests())

    def _guests(self) -> list[int]:
        root, parent, count = c_ulong(), c_ulong(), c_uint()
        children = POINTER(c_ulong)()
        if not self._x11.XQueryTree(
            self._display, self._window, byref(root), byref(parent), byref(children), byref(count)
        ):
            return []
        windows = [children[index] for index in range(count.value)]
        if children:
            self._x11.XFree(children)
        return [window for window in windows if window != self._shield]

    def fill(self, guest: int, width: int, height: int) -> None:
        """Resize the guest and the shield to fill the window [px]."""
        for window in (guest, self._shield):
            self._x11.XMoveResizeWindow(self._display, window, 0, 0, max(1, width), max(1, height))
        self._sync()

    def size(self, guest: int) -> tuple[int, int]:
        """Return width and height of the guest [px]; (0, 0) when it is gone."""
        attributes = _Attributes()
        self._x11.XGetWindowAttributes(self._display, guest, byref(attributes))
        return attributes.width, attributes.height

    def give_keyboard(self, guest: int) -> None:
        """Remove the shield and give the keyboard focus to the guest."""
        self._x11.XUnmapWindow(self._display, self._shield)
        self._x11.XSetInputFocus(self._display, guest, _REVERT_TO_PARENT, _CURRENT_TIME)
        self._sync()

    def take_keyboard(self, window: int) -> None:
        """Give the keyboard focus to `window`, one of this process, and put the shield over the guest again."""
        self._x11.XSetInputFocus(self._display, window, _REVERT_TO_PARENT, _CURRENT_TIME)
        self.raise_shield()

    def raise_shield(self) -> None:
        """Put the shield over the guest; `events` reports a click on it."""
        self._x11.XMapRaised(self._display, self._shield)
        self._sync()

    def grab_key(self, name: str) -> None:
        """Keep this key from the guest; `events` reports it instead. Source of the names: X11/keysymdef.h."""
        code = self._x11.XKeysymToKeycode(self._display, self._x11.XStringToKeysym(name.encode()))
        self._keys[code] = name
        self._x11.XGrabKey(self._display, code, _ANY_MODIFIER, self._window, 0, _GRAB_ASYNC, _GRAB_ASYNC)
        self._sync()

    def events(self) -> list[str]:
        """Return what has happened since the last call: "click" for the shield, and the names of grabbed keys."""
        event, happened = _Event(), []
        while self._x11.XPending(self._display):
            self._x11.XNextEvent(self._display, byref(event))
            if event.kind == _BUTTON_PRESS:
                happened.append("click")
            elif event.kind == _KEY_PRESS and event.key.keycode in self._keys:
                happened.append(self._keys[event.key.keycode])
        return happened

    def close(self) -> None:
        if self._display:
            self._x11.XCloseDisplay(self._display)
            self._display = None

    def _is_viewable(self, window: int) -> bool:
        attributes = _Attributes()
        self._x11.XGetWindowAttributes(self._display, window, byref(attributes))
        return attributes.map_state == _IS_VIEWABLE

    def _sync(self) -> None:
        self._x11.XSync(self._display, 0)
