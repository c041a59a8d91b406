import os

import pytest

from telepresence.teleop.joystick import AXIS, BUTTON, EVENT, INITIAL, Joystick, JoystickGone


@pytest.fixture
def pad(tmp_path):
    """A pipe in place of /dev/input/js0: the kernel's events are plain bytes."""
    path = tmp_path / "js0"
    os.mkfifo(path)
    device = Joystick(str(path))
    writer = os.open(path, os.O_WRONLY)
    yield device, writer
    device.close()


def send(writer, *events):
    os.write(writer, b"".join(EVENT.pack(0, value, kind, number) for kind, number, value in events))


def test_axes_and_buttons(pad):
    device, writer = pad
    send(writer, (AXIS | INITIAL, 0, 0), (AXIS | INITIAL, 1, 0), (BUTTON | INITIAL, 5, 0))
    device.wait(1.0)
    assert (device.axes, device.buttons) == ([0.0, 0.0], [0] * 6)
    send(writer, (AXIS, 1, -32767), (AXIS, 0, 32767), (BUTTON, 5, 1))
    device.wait(1.0)
    assert device.axes == [-1.0, 1.0] and device.buttons[5] == 1  # stick up is +1, right is -1, as in sensor_msgs/Joy


def test_each_press_is_told_though_the_button_is_up_again(pad):
    device, writer = pad
    send(writer, (BUTTON | INITIAL, 0, 1), (BUTTON | INITIAL, 1, 0))
    device.wait(1.0)
    assert (device.buttons, device.pressed) == ([1, 0], []), "what is down from the start was not pressed now"
    send(writer, (BUTTON, 1, 1), (BUTTON, 1, 0), (BUTTON, 0, 0), (BUTTON, 0, 1))
    device.wait(1.0)
    assert (device.buttons, device.pressed) == ([1, 0], [1, 0])
    device.wait(0.0)
    assert device.pressed == [], "once"
    send(writer, (BUTTON | INITIAL, 0, 1), (BUTTON | INITIAL, 1, 1))  # the kernel's buffer has run over
    device.wait(1.0)
    assert device.pressed == [1]


def test_half_an_event_waits_for_the_rest(pad):
    device, writer = pad
    event = EVENT.pack(0, 1, BUTTON, 0)
    os.write(writer, event[:3])
    device.wait(1.0)
    assert device.buttons == []
    os.write(writer, event[3:])
    device.wait(1.0)
    assert device.buttons == [1]


def test_unplugging_is_noticed(pad):
    device, writer = pad
    os.close(writer)
    with pytest.raises(JoystickGone):
        device.wait(1.0)


def test_no_pad_is_an_error(tmp_path):
    with pytest.raises(OSError):
        Joystick(str(tmp_path / "js7"))
