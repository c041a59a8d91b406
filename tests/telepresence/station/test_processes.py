"""Programs end, with everything they started."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from telepresence.station import processes

SETPRIV = shutil.which("setpriv")
STUBBORN = (
    "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); print('ready', flush=True); time.sleep(60)"
)


def test_end_insists_when_a_program_ignores_sigint():
    process = processes.start([sys.executable, "-c", STUBBORN], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    assert processes.end(process, patience=2.0) == -15
    process.stdout.close()


def test_end_of_an_ended_program_returns_its_code():
    process = processes.start([sys.executable, "-c", "raise SystemExit(7)"])
    process.wait()
    assert processes.end(process) == 7


@pytest.mark.parametrize("interrupt", ["SIG_DFL", "SIG_IGN"])
def test_a_tied_program_ends_when_its_parent_is_killed(wait_until, interrupt):
    """Also below a background job of a shell, which ignores SIGINT, as do then all programs that it starts."""
    parent = (
        f"import os, signal; signal.signal(signal.SIGINT, signal.{interrupt});"
        "from telepresence.station import processes;"
        "child = processes.start(['sleep', '60'], tied=True); print(child.pid, flush=True); signal.pause()"
    )
    killed = subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True)
    child = int(killed.stdout.readline())
    wait_until(lambda: b"sleep" in Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")[0], "setpriv has made way")
    killed.kill()
    killed.wait()
    killed.stdout.close()
    wait_until(lambda: child not in processes.descendants(), "the child has ended")


def test_a_tied_program_whose_parent_is_dead_before_it_begins_does_not_begin(tmp_path):
    """A roscore that was killed as it started its rosout left it behind."""
    late = tmp_path / "setpriv"
    late.write_text(f'#!/bin/sh\nwhile [ ! -e {tmp_path}/parent_is_dead ]; do sleep 0.01; done\nexec {SETPRIV} "$@"\n')
    late.chmod(0o755)
    parent = (
        "import os; from telepresence.station import processes;"
        f"processes.start(['touch', '{tmp_path}/begun'], tied=True); os._exit(0)"
    )
    words = [sys.executable, "-c", parent]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    ) as killed:
        killed.wait()
        (tmp_path / "parent_is_dead").touch()
        assert killed.stdout.read() == b"", "closed by the last that had it"
    assert not (tmp_path / "begun").exists()


def test_a_tied_program_that_does_not_exist_is_told_at_once():
    with pytest.raises(FileNotFoundError, match="no-such-program"):
        processes.start(["no-such-program"], tied=True)


def test_orphans_in_sessions_of_their_own_are_ended():
    parent = (
        "import subprocess, os, signal;"
        "child = subprocess.Popen(['sleep', '60'], start_new_session=True);"
        "print(child.pid, flush=True); os.kill(os.getpid(), signal.SIGKILL)"
    )
    supervisor = (
        "from telepresence.station import processes; import subprocess, sys;"
        "processes.adopt_orphans();"
        f"p = subprocess.Popen([sys.executable, '-c', {parent!r}], stdout=subprocess.PIPE, text=True);"
        "pid = int(p.stdout.readline()); p.wait();"
        "assert pid in processes.descendants(), 'the orphan was not adopted';"
        "processes.end_descendants(patience=1.0); print(pid)"
    )
    answer = subprocess.run([sys.executable, "-c", supervisor], capture_output=True, text=True, timeout=60)
    assert answer.returncode == 0, answer.stderr
    assert not processes.send(int(answer.stdout), 0), "the orphan lives on"


def test_an_emulation_that_knows_no_adopting_is_named_and_not_fatal(monkeypatch, caplog):
    monkeypatch.setattr(processes, "PR_SET_CHILD_SUBREAPER", 12345)  # the kernel answers as QEMU does: EINVAL
    processes.adopt_orphans()
    assert "nobody adopts orphans here" in caplog.text
