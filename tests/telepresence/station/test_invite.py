"""`./stack invite`: what is made with it opens the page's entrance."""

import re
from pathlib import Path

import cv2
import numpy
import pytest

from telepresence.station.invite import duration, main
from telepresence.teleop.invitations import InvitationError, Invitations, beside
from telepresence.teleop.key_agreement import OPEN

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def users(tmp_path):
    Invitations(beside(tmp_path / "users.db")).set_page("https://192.0.2.7:8443/")
    return tmp_path / "users.db"


@pytest.fixture
def invite(users, capsys):
    def run(*words):
        code = main([*words, "--users", str(users)])
        said = capsys.readouterr()
        return code, said.out + said.err

    return run


@pytest.mark.parametrize(("word", "role"), [("--drive", "pilot"), ("--watch", "watcher")])
def test_a_link_is_made_listed_used_and_withdrawn(invite, users, word, role):
    code, said = invite(word, "--for", "30m", "--once")
    link = re.search(r"https://192\.0\.2\.7:8443/#i=([\w-]{43})\n", said)
    assert code == 0 and "One person" in said and "30 min" in said
    id = re.search(r"--withdraw (\w+)", said)[1]
    assert invite("--list")[1].splitlines()[1].split()[:6] == [id, word[2:], "30", "min", "0", "of"]
    invitations = Invitations(beside(users))
    assert invitations.use(link[1], "Lena", OPEN.lease)[0].role == role
    assert invite("--withdraw", id)[0] == 0 and invitations.guests() == {}
    with pytest.raises(InvitationError):
        invitations.use(link[1], "Lena", OPEN.lease)
    assert invite("--list") == (0, "There are no links.\n")


def test_what_cannot_be_done_is_said(invite, tmp_path):
    assert invite("--withdraw", "x")[0] == 1
    code, said = invite("--drive", "--for", "8d")
    assert code == 1 and "seven days" in said
    assert main(["--drive", "--users", str(tmp_path / "other.db")]) == 1, "there is no page"


@pytest.mark.parametrize("words", [[], ["--drive", "--watch"], ["--drive", "--for", "2"], ["--drive", "--for", "-2h"]])
def test_it_is_a_command_of_stack_that_explains_itself(words):
    with pytest.raises(SystemExit):
        main(words)
    assert "\n  invite)" in (ROOT / "stack").read_text() and "  invite " in (ROOT / "stack").read_text()


def test_times_are_said_as_people_do():
    assert [duration(s) for s in (1, 1800, 7200, 93600, 90060)] == [
        "1 min",
        "30 min",
        "2 h",
        "1 d 2 h",
        "1 d 1 h 1 min",
    ]


def test_the_code_on_the_terminal_is_the_link(invite):
    code, said = invite("--drive")
    lines = [re.sub(r"\033\[[\d;]*m", "", line) for line in said.splitlines() if "\033" in line]
    halves = {" ": "00", "▄": "01", "▀": "10", "█": "11"}
    dark = [[halves[letter][half] == "1" for letter in line] for line in lines for half in (0, 1)]
    picture = numpy.kron(numpy.where(numpy.array(dark), 0, 255).astype(numpy.uint8), numpy.ones((6, 6), numpy.uint8))
    found, *_ = cv2.QRCodeDetectorAruco().detectAndDecode(picture)
    assert code == 0 and found and found in said
