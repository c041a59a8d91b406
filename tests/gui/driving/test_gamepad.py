"""The gamepad as a hand on the robot; a pipe stands for the device."""

import os

import pytest

from gui.driving.gamepad import RESTART_HOLD, Gamepad
from gui.driving.gamepad_view import GamepadView
from gui.driving.input_mux import InputMux
from telepresence.teleop.joystick import AXIS, BUTTON, EVENT

LB, RB, B = 4, 5, 1
CROSS_Y = 7
ZERO = (0.0, 0.0, 0.0)


class Plug:
    """The pad's end of the pipe."""

    def __init__(self, path):
        self.path, self.end = path, None

    def put_in(self):
        self.end = os.open(self.path, os.O_WRONLY)
        self.send(*((AXIS, axis, 0) for axis in range(8)), *((BUTTON, button, 0) for button in range(11)))

    def send(self, *events):
        os.write(self.end, b"".join(EVENT.pack(0, value, kind, number) for kind, number, value in events))

    def pull_out(self):
        os.close(self.end)
        self.end = None


@pytest.fixture
def pad(qt, tmp_path, spin):
    path = tmp_path / "js0"
    os.mkfifo(path)
    pad = Gamepad(str(path))
    pad.sent, pad.happened = [], []
    pad.velocity.connect(lambda *velocity: pad.sent.append(velocity))
    for name in ("stop_pressed", "restart_wanted", "lost", "blocked"):
        getattr(pad, name).connect(lambda *values, name=name: pad.happened.append((name, *values)))
    pad.start()
    pad.plug = Plug(path)
    pad.plug.put_in()
    spin(lambda: pad.state and len(pad.state.buttons) == 11, "the pad is found")
    yield pad
    pad.close()
    if pad.plug.end is not None:
        pad.plug.pull_out()


def test_drives_only_while_lb_is_held(pad, spin):
    pad.plug.send((AXIS, 1, -32767))
    spin(lambda: pad.state.axes[1] == 1.0, "the stick is up")
    assert pad.sent == []
    pad.plug.send((BUTTON, LB, 1))
    spin(lambda: pad.sent[-3:] == [(pytest.approx(0.2), 0.0, 0.0)] * 3, "it drives, repeatedly")
    assert pad.keeps_control and pad.state.driving
    pad.plug.send((BUTTON, LB, 0))
    spin(lambda: pad.sent[-1] == ZERO, "letting go stops")
    assert not pad.keeps_control


def test_rb_is_fast_within_the_top_speed(pad, spin):
    pad.top_speed = 0.3
    pad.speed = 0.2
    pad.plug.send((AXIS, 1, -32767), (BUTTON, RB, 1), (BUTTON, LB, 1))
    spin(lambda: pad.sent and pad.sent[-1][0] == pytest.approx(0.3), "fast, but not above the top speed")


def test_pulling_it_out_stops_and_it_is_found_again(pad, spin):
    pad.plug.send((AXIS, 1, -32767), (BUTTON, LB, 1))
    spin(lambda: pad.sent and pad.sent[-1][0] > 0.1, "it drives")
    pad.plug.pull_out()
    spin(lambda: pad.sent[-1] == ZERO, "it stops")
    assert pad.happened[-1] == ("lost",) and pad.state is None
    spin(lambda: pad.state is not None, "it is looked for again")
    pad.plug.put_in()
    spin(lambda: len(pad.state.buttons) == 11, "and found")


def test_a_block_stops_is_told_and_needs_a_new_press(pad, spin):
    pad.plug.send((AXIS, 1, -32767), (BUTTON, LB, 1))
    spin(lambda: pad.sent and pad.sent[-1][0] > 0.1, "it drives")
    pad.set_block("The picture is lost.")
    assert pad.sent[-1] == ZERO
    pad.set_block("")
    spin(lambda: "Let go of LB" in pad.state.note, "it asks for a new press")
    assert pad.sent[-1] == ZERO
    pad.set_block("The picture is lost.")
    pad.plug.send((BUTTON, LB, 0))
    spin(lambda: not pad.state.buttons[LB], "LB is up")
    pad.plug.send((BUTTON, LB, 1))
    spin(lambda: ("blocked", "The picture is lost.") in pad.happened, "it says why it does not drive")
    assert pad.sent[-1] == ZERO


def test_b_stops_and_button_0_must_be_held_to_restart(pad, spin):
    pad.plug.send((BUTTON, B, 1), (BUTTON, B, 0))
    pad.plug.send((BUTTON, B, 1))
    spin(lambda: ("stop_pressed",) in pad.happened, "B stops")
    pad.plug.send((BUTTON, 0, 1))
    spin(lambda: pad.state.restart > 0.3 * RESTART_HOLD, "the hold counts up")
    pad.plug.send((BUTTON, 0, 0))
    spin(lambda: pad.state.restart == 0.0, "and back")
    assert ("restart_wanted",) not in pad.happened
    pad.plug.send((BUTTON, 0, 1))
    spin(lambda: ("restart_wanted",) in pad.happened, "held long enough")
    spin(lambda: pad.state.restart == 0.0, "once")
    assert pad.happened.count(("restart_wanted",)) == 1


def test_a_pad_elsewhere_that_falls_silent_stops(qt, spin):
    pad = Gamepad(None)
    sent, lost = [], []
    pad.velocity.connect(lambda *velocity: sent.append(velocity))
    pad.lost.connect(lambda: lost.append(True))
    up, down = [0] * 11, [0] * LB + [1] + [0] * 6
    pad.receive([0.0] * 8, up)
    pad.receive([0.0, 1.0] + [0.0] * 6, down)
    assert sent[-1][0] == pytest.approx(0.2)
    spin(lambda: sent[-1] == ZERO, "silence stops")
    spin(lambda: lost, "and then it counts as gone")


def test_the_live_test_paints_every_state(pad, spin):
    view = GamepadView()
    view.resize(420, 190)
    pad.changed.connect(view.show_state)
    empty = view.grab().toImage()
    pad.plug.send((AXIS, 0, 20000), (BUTTON, LB, 1), (BUTTON, 7, 1))
    spin(lambda: pad.state.driving and pad.state.buttons[7], "it drives")
    assert view.grab().toImage() != empty
    assert view.accessibleDescription() == "Drives."


def test_b_stops_a_pad_that_stops_with_all_others(pad, spin):
    """The mux lets go of every device when one of them stops, this one too: that is no second press."""
    mux = InputMux()
    mux.add(pad)
    pad.stop_pressed.connect(mux.stop)
    pad.plug.send((BUTTON, B, 1))
    spin(lambda: pad.happened, "B stops")
    assert pad.happened == [("stop_pressed",)]


def test_the_terminal_says_what_was_detected_and_pressed(pad, spin, caplog):
    with caplog.at_level("INFO", "gui"):
        pad.plug.pull_out()
        spin(lambda: pad.state is not None, "it is looked for again")
        pad.plug.put_in()
        spin(lambda: len(pad.state.buttons) == 11, "and found")
        pad.plug.send((BUTTON, 0, 1))
        spin(lambda: pad.state.buttons[0], "button 0 is down")
    said = [record.getMessage() for record in caplog.records if record.levelname == "INFO"]
    assert said == ["Joystick detected: Gamepad", "Button 0 pressed"]


@pytest.mark.parametrize("axis", [CROSS_Y, 1], ids=["cross", "left stick"])
def test_without_lb_up_and_down_walk_and_button_0_restarts_at_once(pad, spin, axis):
    pad.direct = True
    spin(lambda: "Cross" in pad.state.note, "it says how to walk")
    pad.plug.send((AXIS, axis, -32767))
    spin(lambda: pad.sent and pad.sent[-1][0] > 0.0, "up is forward")
    pad.plug.send((AXIS, axis, 0))
    spin(lambda: pad.sent[-1] == ZERO, "letting go stops")
    pad.plug.send((AXIS, axis, 32767))
    spin(lambda: pad.sent[-1][0] < 0.0, "down is backward")
    pad.set_block("The picture is lost.")
    assert pad.sent[-1] == ZERO
    pad.set_block("")
    pad.plug.send((BUTTON, 0, 1))
    spin(lambda: ("restart_wanted",) in pad.happened, "button 0 restarts at once")
    assert pad.sent[-1] == ZERO, "what was held has to be let go first"
    pad.plug.send((AXIS, axis, 0), (AXIS, axis, -32767))
    pad.plug.send((AXIS, axis, 0))
    spin(lambda: pad.state.axes[axis] == 0.0, "it is let go")
    pad.plug.send((AXIS, axis, -32767))
    spin(lambda: pad.sent[-1][0] > 0.0, "and drives again")
    assert pad.happened.count(("restart_wanted",)) == 1
