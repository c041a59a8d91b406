"""Single keys from real terminals."""

import sys
import textwrap

import pytest

READER = textwrap.dedent("""
    import sys
    from twist_keyboard.terminal import HungUp, KeyTerminal
    try:
        with KeyTerminal(0) as terminal:
            print("ready", flush=True)
            while True:
                for key in terminal.read_keys(0.05):
                    print("key", repr(key), flush=True)
                    if key == "q":
                        sys.exit(0)
    except HungUp:
        sys.exit(7)
""")


@pytest.fixture
def reader(open_terminal, wait_until, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", ":".join(path for path in sys.path if path.endswith("teleop_twist_keyboard/src")))
    terminal = open_terminal(sys.executable, "-c", READER)
    wait_until(lambda: "ready" in terminal.seen, "the reader is ready")
    return terminal


def test_keys_arrive_one_by_one_without_echo(reader, wait_until):
    assert not reader.echoes() and not reader.takes_lines()
    reader.type("i")
    wait_until(lambda: "key 'i'\r\n" in reader.seen, "the key arrives without Enter")
    reader.type("\x1b[A")
    wait_until(lambda: "key 'up'\r\n" in reader.seen, "an arrow is one key")
    assert "ready\r\nkey 'i'\r\nkey 'up'\r\n" == reader.seen


def test_the_terminal_is_put_back(reader):
    reader.type("q")
    assert reader.process.wait(10) == 0
    assert reader.echoes() and reader.takes_lines()


def test_a_terminal_left_without_echo_by_a_killed_program_gets_it_back(open_terminal, wait_until, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", ":".join(path for path in sys.path if path.endswith("teleop_twist_keyboard/src")))
    terminal = open_terminal("sh", "-c", 'stty -echo -icanon; exec "$@"', "sh", sys.executable, "-c", READER)
    wait_until(lambda: "ready" in terminal.seen, "the reader is ready")
    terminal.type("q")
    assert terminal.process.wait(10) == 0
    assert terminal.echoes() and terminal.takes_lines()


def test_hanging_up_is_noticed(reader):
    reader.hang_up()
    # The kernel's SIGHUP comes first where the terminal is the controlling one.
    assert reader.process.wait(10) in (7, -1)
