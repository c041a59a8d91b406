"""A gamepad read from Linux's joystick interface, for systems without joy_node.

An event is 8 bytes: uint32 time [ms], int16 value, uint8 type (1 button, 2 axis; 0x80 at the start: the present state),
uint8 number. Left and up are negative there and positive in sensor_msgs/Joy. Source: Linux,
Documentation/input/joydev/joystick-api.rst; the signs: ROS package joy.
"""

from __future__ import annotations

import array
import contextlib
import fcntl
import os
import select
import struct

EVENT = struct.Struct("<IhBB")
BUTTON, AXIS, INITIAL = 0x01, 0x02, 0x80
FULL = 32767
MOST = 64
"""Largest number of axes and of buttons."""

# Requests of linux/joystick.h: _IOR('j', number, size).
_NAME_SIZE, _AXES, _BUTTONS = 128, 0x40, 0x200
_GET_NAME = 2 << 30 | _NAME_SIZE << 16 | ord("j") << 8 | 0x13
_GET_AXIS_MAP = 2 << 30 | _AXES << 16 | ord("j") << 8 | 0x32
_GET_BUTTON_MAP = 2 << 30 | 2 * _BUTTONS << 16 | ord("j") << 8 | 0x34


class JoystickGone(OSError):
    """The gamepad was unplugged."""


class Joystick:
    """An open gamepad; `axes` (-1 to 1, left and up positive) and `buttons` (0 or 1) are its present state, `pressed`
    are the buttons that went down in the last `wait`, in order, whether or not they are up again.

    Raises:
        OSError: There is none at `path`.
    """

    def __init__(self, path: str = "/dev/input/js0") -> None:
        self.axes: list[float] = []
        self.buttons: list[int] = []
        self.pressed: list[int] = []
        self._rest = b""
        self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        self.name = (
            self._ask(_GET_NAME, array.array("B", bytes(_NAME_SIZE)))
            .tobytes()
            .partition(b"\0")[0]
            .decode(errors="replace")
        )
        """The kernel's name for the device; empty when it is no joystick."""
        self.axis_codes = list(self._ask(_GET_AXIS_MAP, array.array("B", bytes(_AXES))))
        """What the axes are: ABS_... of linux/input-event-codes.h by number; all 0 when unknown."""
        self.button_codes = list(self._ask(_GET_BUTTON_MAP, array.array("H", bytes(2 * _BUTTONS))))
        """What the buttons are: BTN_... by number; all 0 when unknown."""

    def fileno(self) -> int:
        """Return the file descriptor, for `select` elsewhere."""
        return self._file

    def _ask(self, request: int, answer: array.array) -> array.array:
        # A pipe in place of a device knows none of this.
        with contextlib.suppress(OSError):
            fcntl.ioctl(self._file, request, answer, True)
        return answer

    def close(self) -> None:
        os.close(self._file)

    def wait(self, timeout: float) -> None:
        """Wait up to `timeout` seconds for events and apply them; return after the first ones.

        Raises:
            JoystickGone: It was unplugged.
        """
        self.pressed = []
        if not select.select([self._file], [], [], timeout)[0]:
            return
        try:
            data = os.read(self._file, 64 * EVENT.size)
        except BlockingIOError:
            return
        except OSError as error:
            raise JoystickGone(f"the gamepad is gone: {error.strerror}") from error
        if not data:
            raise JoystickGone("the gamepad is gone")
        data = self._rest + data
        whole = len(data) - len(data) % EVENT.size
        self._rest = data[whole:]
        for _, value, kind, number in EVENT.iter_unpack(data[:whole]):
            self._apply(kind & ~INITIAL, number, value, bool(kind & INITIAL))

    def _apply(self, kind: int, number: int, value: int, initial: bool) -> None:
        if number >= MOST:
            return
        if kind == AXIS:
            self.axes += [0.0] * (number + 1 - len(self.axes))
            self.axes[number] = max(-1.0, min(1.0, -value / FULL))
        elif kind == BUTTON:
            # The kernel tells the state anew when its buffer has run over: what was up has been pressed meanwhile.
            known = number < len(self.buttons) or not initial
            self.buttons += [0] * (number + 1 - len(self.buttons))
            if value and known and not self.buttons[number]:
                self.pressed.append(number)
            self.buttons[number] = int(value != 0)
