"""Which key of the keyboard an event is of, whatever it types: with AltGr a held key types another letter, and a
keyboard that writes Greek or Russian has no W."""

from __future__ import annotations

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QKeyEvent

_FIRST_ROW, _SECOND_ROW = 24, 38
"""X's key codes of Q and A, eight more than the kernel's in linux/input-event-codes.h."""
_PLACES = {
    first + place: ord(letter)
    for first, letters in ((_FIRST_ROW, "QWERTYUIOP"), (_SECOND_ROW, "ASDFGHJKL"))
    for place, letter in enumerate(letters)
}
_LATIN = 0x24F
"""The last letter of Unicode's Latin blocks; Qt's keys are Unicode's for whatever is printed."""


def physical_key(event: QKeyEvent) -> int:
    """Return a number that is the same when the key goes down and when it comes up, whatever is held beside it."""
    # Zero for an event that no keyboard sent.
    return event.nativeScanCode() or event.key()


def command_key(event: QKeyEvent) -> int:
    """Return the `Qt.Key` that a key stands for: itself; on a keyboard without Latin letters that of its place on an
    American one."""
    key = event.key()
    if _LATIN < key < Qt.Key.Key_Escape and chr(key).isalpha():
        return _PLACES.get(event.nativeScanCode(), key)
    return key
