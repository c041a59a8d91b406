"""The gamepad as a hand on the robot; a pipe stands for the device."""

import os
import time
from types import SimpleNamespace

import pytest

from gui.driving.gamepad import ELSEWHERE, RESTART_HOLD, Gamepad
from gui.driving.gamepad_view import GamepadView
from gui.driving.input_mux import InputMux
from gui.ros.channels import Channel
from gui.ros.topics.drive import JOY
from telepresence.teleop.joystick import AXIS, BUTTON, EVENT, INITIAL

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


def test_a_tap_counts_though_press_and_release_come_in_one_read(pad, spin):
    """A window that was held up reads them together."""
    mux = InputMux()
    mux.add(pad)
    pad.stop_pressed.connect(mux.stop)
    pad.plug.send((AXIS, 1, -32767), (BUTTON, LB, 1))
    spin(lambda: pad.sent and pad.sent[-1][0] > 0.1, "it drives")
    pad.plug.send((BUTTON, B, 1), (BUTTON, B, 0))
    spin(lambda: pad.happened, "B stops")
    assert pad.happened == [("stop_pressed",)] and pad.sent[-1] == ZERO
    spin(lambda: "Let go of LB" in pad.state.note, "it asks for a new press")
    pad.set_block("The picture is lost.")
    pad.plug.send((BUTTON, LB, 0), (BUTTON, LB, 1), (BUTTON, LB, 0))
    spin(lambda: ("blocked", "The picture is lost.") in pad.happened, "it says why it does not drive")
    pad.direct = True
    pad.plug.send((BUTTON, 0, 1), (BUTTON, 0, 0))
    spin(lambda: ("restart_wanted",) in pad.happened, "button 0 restarts")
    assert pad.happened.count(("restart_wanted",)) == pad.happened.count(("stop_pressed",)) == 1


def test_letting_go_of_button_0_for_a_moment_begins_the_hold_anew(pad, spin):
    pad.plug.send((BUTTON, 0, 1))
    spin(lambda: pad.state.restart > 0.3 * RESTART_HOLD, "the hold counts up")
    held = pad.state.restart
    pad.plug.send((BUTTON, 0, 0), (BUTTON, 0, 1))
    spin(lambda: pad.state.restart < held, "and begins anew")
    assert pad.happened == []


def test_what_is_down_when_the_pad_is_found_stops_and_restarts_nothing(pad, spin):
    """Nobody knows since when it has been down: a stop too many does no harm, a restart does."""
    pad.plug.pull_out()
    spin(lambda: ("lost",) in pad.happened and pad.state is not None, "it is looked for again")
    pad.happened.clear()
    pad.plug.end = os.open(pad.plug.path, os.O_WRONLY)
    pad.plug.send(*((BUTTON | INITIAL, button, int(button in (0, B))) for button in range(11)))
    spin(lambda: len(pad.state.buttons) == 11, "and found")
    assert pad.happened == [("stop_pressed",)] and pad.state.restart == 0.0
    deadline = time.monotonic() + 1.2 * RESTART_HOLD
    spin(lambda: time.monotonic() > deadline, "button 0 is held as long as a restart takes")
    assert pad.happened == [("stop_pressed",)]


def test_each_tap_on_a_pad_elsewhere_counts_once_though_the_window_was_held_up(qt):
    pad, stops = Gamepad(None), []
    pad.stop_pressed.connect(lambda: stops.append(True))
    topic = Channel(JOY)
    topic.wanted = True
    topic.arrived.connect(lambda joy: pad.receive(*joy))
    for down in (0, 1, 1, 0, 1, 0):
        topic.post(SimpleNamespace(axes=[0.0] * 8, buttons=[0, down] + [0] * 9))
    qt.processEvents()
    assert len(stops) == 2
    pad.close()


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


def test_a_pad_of_a_window_behind_others_drives_nothing_and_still_stops(pad, spin):
    pad.set_elsewhere(True)
    pad.plug.send((AXIS, 1, -32767), (BUTTON, LB, 1))
    spin(lambda: any(name == "blocked" for name, *_ in pad.happened), "it says why")
    assert not any(map(any, pad.sent)) and not pad.keeps_control and ELSEWHERE in pad.state.note
    pad.plug.send((BUTTON, B, 1), (BUTTON, B, 0))
    spin(lambda: ("stop_pressed",) in pad.happened, "B stops")
    pad.set_elsewhere(False)
    assert not any(map(any, pad.sent)), "LB is pressed again first"
    pad.plug.send((BUTTON, LB, 0))
    spin(lambda: not pad.state.buttons[LB], "LB is up")
    pad.plug.send((BUTTON, LB, 1))
    spin(lambda: pad.sent and any(pad.sent[-1]), "it drives")
    pad.set_elsewhere(True)
    spin(lambda: pad.sent[-1] == ZERO, "it stops when another window comes to the front")


def test_button_0_of_a_window_behind_others_restarts_nothing(pad, spin, monkeypatch):
    monkeypatch.setattr("gui.driving.gamepad.RESTART_HOLD", 0.0)
    pad.set_elsewhere(True)
    pad.plug.send((BUTTON, 0, 1))
    spin(lambda: pad.state.buttons[0], "it is down")
    pad.plug.send((BUTTON, B, 1))
    spin(lambda: ("stop_pressed",) in pad.happened, "a tick later")
    assert ("restart_wanted",) not in pad.happened
