"""What the soak makes of its samples: names, growth over restarts, tracebacks, a record that was cut off."""

import json
import os
import subprocess
import sys
from itertools import islice

import numpy as np
import pytest
from soak import page, schedule
from soak.findings import find, grows
from soak.growth import growth
from soak.record import Recorder, read
from soak.samples import LogReader, Usage, names, program_name, sample

HOUR = 3600.0


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("/usr/bin/python3 /x/naoqi_driver_py/naoqi_moveto.py __name:=naoqi_driver __log:=/r/naoqi_driver-3.log",
         "naoqi_driver"),
        ("python /x/camera.py __log:=/r/pepper_robot-camera-front-11.log", "pepper_robot-camera-front"),
        ("/venv/bin/python -m telepresence_ros.core -p 11311", "telepresence_ros.core"),
        ("python3 /x/robotino_onboard drive --robot 10.0.0.2:8080", "robotino_onboard drive"),
        ("Xvfb -displayfd 5", "Xvfb"),
        ("/venv/bin/python3 -I -c print()", "python -c"),
    ],
)  # fmt: skip
def test_a_program_keeps_its_name_across_restarts(words, name):
    assert program_name(words.split()) == name


def test_a_running_program_is_sampled(run_program):
    command = (sys.executable, "-u", "-m", "http.server", "0", "--bind", "127.0.0.1")
    program = run_program(*command, stdout=subprocess.PIPE, text=True)
    assert "Serving HTTP" in program.stdout.readline()  # before, it grows between the readings of one sample
    usage = sample([program.pid])["http.server"]
    assert usage.descriptors > 3  # the socket, beside the three that every program has
    assert usage.rss >= usage.pss > 1000 and usage.threads >= 1
    assert usage.life.startswith(f"{program.pid}@")
    assert names([program.pid]) == {"http.server"}


def life(begin, hours, level, slope, noise, dice):
    times = np.arange(begin, begin + hours * HOUR, 20.0)
    return np.column_stack([times, level + slope * (times - begin) / HOUR + dice.normal(0.0, noise, len(times))])


@pytest.mark.parametrize(("slope", "leaks"), [(0.0, False), (2000.0, True)])
def test_growth_is_seen_through_restarts_and_peaks(slope, leaks):
    """Eight lives of an hour, each from the same level, with caches that fill in the first minutes, and peaks."""
    dice = np.random.default_rng(1)
    lives = [life(begin * HOUR, 1.0, 100_000.0, slope, 300.0, dice) for begin in range(8)]
    for samples in lives:
        samples[samples[:, 0] < samples[0, 0] + 300.0, 1] -= 20_000.0
        samples[dice.integers(0, len(samples), 5), 1] += 50_000.0
    found = growth(lives, settle=600.0, since=HOUR, bin_width=420.0)
    assert found.low <= slope <= found.high and found.high - found.low < 1000.0
    assert grows(found, 1000.0) is leaks


def test_too_few_samples_prove_nothing():
    assert not growth([], 0.0, 0.0, 1.0).known
    assert not grows(growth([np.array([[0.0, 1.0], [60.0, 9.0], [120.0, 90.0]])], 0.0, 0.0, 60.0), 0.0)


def test_tracebacks_and_what_is_written_are_found_in_rotated_logs_too(tmp_path):
    log, logs = tmp_path / "node-3.log", LogReader(tmp_path)
    log.write_text("fine\nTraceback (most recent call last):\n  File x\n")
    logs.read()
    with log.open("a") as file:
        file.write("    1 / 0\nZeroDivisionError: division by zero\nfine again\n")
    logs.read()
    first = log.stat().st_size
    os.rename(log, tmp_path / "node-3.log.1")
    log.write_text("a new file\n")
    logs.read()
    log.write_text("cut\n")
    logs.read()
    assert logs.tracebacks == {("node.log", "ZeroDivisionError: division by zero"): 1}
    assert logs.written == first + len("a new file\n") + len("cut\n")


def test_the_same_seed_gives_the_same_run_with_everything_in_it():
    first, again, other = (list(islice(schedule.rounds(seed), 4)) for seed in (1, 1, 2))
    assert first == again != other
    assert {event.kind for event in first[0]} == {"phase", "drive", "say", "viewer", "kill", "cut"}
    assert all(0.0 <= event.at < schedule.ROUND for events in first for event in events)
    assert max(event.at for event in next(schedule.rounds(1, 24.0))) < 24.0
    unharmed = next(schedule.rounds(1, kills=False))
    assert unharmed == [event for event in first[0] if event.kind != "kill"]


def test_a_record_that_was_cut_off_still_makes_a_report(tmp_path):
    recorder = Recorder(tmp_path / "samples.jsonl", seed=3, loss=0.02, about="")
    recorder.note(0.0, "phase", "driving")
    for second in range(0, 1200, 5):
        if second == 600:
            recorder.note(second, "phase", "idle")
        busy = 0.5 if second < 600 else 0.1
        leaking = Usage("7@1", 50_000 + 100 * second, 40_000, 10, 3, busy * second + 250.0 * (second >= 600))
        recorder.sample(
            second, {"leaking": leaking}, rss=leaking.rss, pss=leaking.pss, descriptors=10, threads=3,
            log_written=second, log_size=second, tracebacks=[["node.log", "KeyError: 'x'", 2]], metres=[1.0, 2.0],
        )  # fmt: skip
    recorder.note(1000.0, "not back", "voice within 30 s")
    recorder.close()
    with (tmp_path / "samples.jsonl").open("a") as file:
        file.write('{"t":1200,"progra')
    findings = page.write(tmp_path / "samples.jsonl", tmp_path / "report")
    assert [line.partition(":")[0] for line in findings.broken] == [
        "leaking", "2 x traceback in node.log", "not back at 1000 s",
    ]  # fmt: skip
    leaking = find(read(tmp_path / "samples.jsonl")).programs[0]
    assert leaking.growths["rss"].slope == pytest.approx(100 * HOUR, rel=0.01)
    assert (leaking.driving, leaking.idle) == (pytest.approx(0.5, abs=0.01), pytest.approx(0.1, abs=0.01))
    assert json.loads((tmp_path / "report" / "report.json").read_text())["programs"][0]["name"] == "leaking"
    names = {path.name for path in (tmp_path / "report").iterdir()}
    assert names == {"report.md", "report.json", *(f"{name}.png" for name in page.PLOTS)}
