"""Which keys are down, asked of the X server that the terminal is on.

A terminal sends characters: it tells neither that a key is let go of nor that two are held. Its X server knows both,
also for a terminal inside tmux or at the other end of `ssh -X`. libxcb through ctypes: unlike libX11 it does not end
the process when the server goes away. Structures: xcb/xproto.h; meaning of the requests: X11 protocol, QueryKeymap,
GetInputFocus, GetKeyboardMapping.
"""

from __future__ import annotations

import ctypes
import os
from ctypes import POINTER, Structure, c_char_p, c_int, c_uint, c_uint8, c_uint16, c_uint32, c_void_p
from typing import Any, NamedTuple

_MIN_KEYCODE, _MAX_KEYCODE = 34, 35
"""Bytes of xcb_setup_t."""


class _Cookie(Structure):
    _fields_ = (("sequence", c_uint),)


class _Keymap(Structure):
    _fields_ = (
        ("kind", c_uint8),
        ("pad", c_uint8),
        ("sequence", c_uint16),
        ("length", c_uint32),
        ("keys", c_uint8 * 32),
    )


class _Focus(Structure):
    _fields_ = (
        ("kind", c_uint8),
        ("revert", c_uint8),
        ("sequence", c_uint16),
        ("length", c_uint32),
        ("window", c_uint32),
    )


class _Mapping(Structure):
    _fields_ = (("kind", c_uint8), ("columns", c_uint8), ("sequence", c_uint16), ("length", c_uint32))


class Held(NamedTuple):
    """The keys that are down, by their letter, and the window that keys go to."""

    keys: frozenset[str]
    window: int


class XKeyboard:
    """A connection to the X server of DISPLAY.

    Args:
        letters: The keys to watch.
    Raises:
        OSError: There is no X server, or no libxcb.
    """

    def __init__(self, letters: str) -> None:
        if not os.environ.get("DISPLAY"):
            raise OSError("there is no DISPLAY")
        self._xcb, self._libc = _library(), ctypes.CDLL(None)
        self._libc.free.argtypes = [c_void_p]
        self._connection = self._xcb.xcb_connect(None, None)
        self._check()
        self._codes = self._find_codes(letters)

    def held(self) -> Held:
        """Return what is held now.

        Raises:
            OSError: The X server does not answer any more.
        """
        keymap = self._ask("xcb_query_keymap")
        focus = self._ask("xcb_get_input_focus")
        down = {letter for letter, codes in self._codes.items() if any(keymap.keys[c // 8] >> c % 8 & 1 for c in codes)}
        return Held(frozenset(down), focus.window)

    def close(self) -> None:
        self._xcb.xcb_disconnect(self._connection)

    def _find_codes(self, letters: str) -> dict[str, list[int]]:
        """Return the codes of the keys that have these letters on them, in any group of the layout."""
        setup = self._xcb.xcb_get_setup(self._connection)
        first, last = setup[_MIN_KEYCODE], setup[_MAX_KEYCODE]
        cookie = self._xcb.xcb_get_keyboard_mapping(self._connection, first, last - first + 1)
        reply = self._xcb.xcb_get_keyboard_mapping_reply(self._connection, cookie, None)
        self._check(reply)
        try:
            columns, count = reply.contents.columns, reply.contents.length
            symbols = self._xcb.xcb_get_keyboard_mapping_keysyms(reply)
            found: dict[str, list[int]] = {letter: [] for letter in letters}
            for index in range(count):
                letter = chr(symbols[index]) if symbols[index] < 128 else ""  # Latin letters are their own keysyms
                if letter in found and first + index // columns not in found[letter]:
                    found[letter].append(first + index // columns)
            return found
        finally:
            self._libc.free(reply)

    def _ask(self, request: str) -> Any:  # a ctypes structure: the checker knows none of its fields
        ask, answer = getattr(self._xcb, request), getattr(self._xcb, f"{request}_reply")
        reply = answer(self._connection, ask(self._connection), None)
        self._check(reply)
        try:
            return type(reply.contents).from_buffer_copy(reply.contents)
        finally:
            self._libc.free(reply)

    def _check(self, reply: object = True) -> None:
        if not reply or self._xcb.xcb_connection_has_error(self._connection):
            raise OSError(f"no X server answers at DISPLAY={os.environ.get('DISPLAY')}")


def _library() -> ctypes.CDLL:
    """Raises OSError where there is none."""
    xcb = ctypes.CDLL("libxcb.so.1")
    xcb.xcb_connect.argtypes, xcb.xcb_connect.restype = [c_char_p, POINTER(c_int)], c_void_p
    xcb.xcb_connection_has_error.argtypes = xcb.xcb_disconnect.argtypes = [c_void_p]
    xcb.xcb_get_setup.argtypes, xcb.xcb_get_setup.restype = [c_void_p], POINTER(c_uint8)
    xcb.xcb_get_keyboard_mapping_keysyms.argtypes = [POINTER(_Mapping)]
    xcb.xcb_get_keyboard_mapping_keysyms.restype = POINTER(c_uint32)
    for request, arguments, reply in (
        ("xcb_query_keymap", [], _Keymap), ("xcb_get_input_focus", [], _Focus),
        ("xcb_get_keyboard_mapping", [c_uint8, c_uint8], _Mapping),
    ):  # fmt: skip
        ask, answer = getattr(xcb, request), getattr(xcb, f"{request}_reply")
        ask.argtypes, ask.restype = [c_void_p, *arguments], _Cookie
        answer.argtypes, answer.restype = [c_void_p, _Cookie, c_void_p], POINTER(reply)
    return xcb
