"""One sentence for each fault, of its cause."""

import pytest

from telepresence.station.fault_sentences import (
    CONSEQUENCE_TIME,
    HOPE_TIME,
    LEAST_TIME,
    NOTICED,
    PROGRAMS,
    SHOWN_TIME,
    Cause,
    Faults,
)


@pytest.fixture
def faults():
    return Faults("Pepper", "/", {"/rto3"})


def sentence(faults, now):
    fault = faults.current(now)
    return fault.sentence if fault else ""


def test_what_is_noticed_is_said_until_it_is_over_and_long_enough_to_read(faults):
    assert sentence(faults, 10.0) == ""
    faults.notice(Cause.DRIVER, True, 10.0)
    assert sentence(faults, 10.0) == NOTICED[Cause.DRIVER].format(robot="Pepper") and "Pepper" in sentence(faults, 10.0)
    faults.notice(Cause.DRIVER, False, 10.2)
    assert sentence(faults, 10.0 + LEAST_TIME - 0.1) and not sentence(faults, 10.0 + LEAST_TIME + 0.1)


def test_a_report_makes_the_sentence_exact_and_ends_with_what_is_noticed(faults):
    faults.picture_programs = {"front"}
    faults.notice(Cause.PICTURE, True, 10.0)
    assert faults.report("/pepper_robot/camera/front", "died: signal 9", "starts again", 10.3) is Cause.PICTURE
    assert sentence(faults, 10.3) == ("The front camera's program died (signal 9); it starts again. The robot stops.")
    faults.notice(Cause.PICTURE, False, 12.0)
    assert not sentence(faults, 12.0) and len(faults.recent) == 1


def test_a_camera_that_nobody_looks_through_stops_no_robot(faults):
    faults.picture_programs = {"front"}
    assert faults.report("/pepper_robot/camera/bottom", "died: signal 9", "starts again", 10.0) is Cause.OTHER
    assert sentence(faults, 10.0) == "The floor camera's program died (signal 9); it starts again."


def test_the_cause_hides_what_follows_from_it(faults):
    faults.notice(Cause.PICTURE, True, 10.0)
    assert sentence(faults, 10.0)
    faults.notice(Cause.SIMULATION, True, 10.2)
    assert "simulated robot" in sentence(faults, 10.2)
    faults.notice(Cause.SIMULATION, False, 13.0)
    assert "picture" in sentence(faults, 13.0), "it still lasts"
    assert [fault.cause for fault in faults.recent] == [Cause.SIMULATION], "but was no fault of its own"


def test_a_report_alone_is_shown_for_a_while_and_later_faults_are_others(faults):
    faults.report("/voice", "froze", "starts again", 10.0)
    assert sentence(faults, 10.0) == "The sound program froze; it starts again."
    assert not sentence(faults, 10.0 + SHOWN_TIME)
    faults.report("/my_node", "died: exit code 1", "stays away", 10.0 + CONSEQUENCE_TIME + 1.0)
    assert "The program my_node died (exit code 1); it stays away." in sentence(faults, 14.0)
    assert len(faults.recent) == 2


@pytest.mark.parametrize(
    ("namespace", "others", "program", "shown"),
    [
        ("/", {"/rto3"}, "/naoqi_driver", True), ("/", {"/rto3"}, "/rto3/drive_lease", False),
        ("/rto3", set(), "/rto3/drive_lease", True), ("/rto3", set(), "/drive_lease", False),
        ("/rto3", set(), "/robot_control_node", True), ("/rto3", set(), "rosmaster", True),
    ],
)  # fmt: skip
def test_another_robots_programs_are_not_this_ones(namespace, others, program, shown):
    faults = Faults("it", namespace, others)
    faults.report(program, "froze", "starts again", 10.0)
    assert bool(sentence(faults, 10.0)) is shown


def test_what_does_not_end_is_not_waited_for_for_ever(faults):
    faults.notice(Cause.MASTER, True, 10.0)
    assert sentence(faults, 10.0 + HOPE_TIME - 0.1) and not sentence(faults, 10.0 + HOPE_TIME)


def test_a_sentence_fits_into_one_line_of_the_banner():
    """In a window of 1280 pixels; a second line would make the picture jump."""
    faults = Faults("Robotino", "/")
    for program, (_, cause) in PROGRAMS.items():
        faults.report(f"/{program}", "died: signal 9", "starts again", 10.0)
        if cause in NOTICED and cause is not Cause.STATION:
            assert len(sentence(faults, 10.0)) <= 90, program
        faults.forget()
    assert max(len(text.format(robot="Robotino")) for text in NOTICED.values()) <= 90


def test_the_page_lists_every_sentence(request):
    page = " ".join((request.config.rootpath / "docs" / "window.md").read_text().split())
    for text in (*NOTICED.values(), *(subject for subject, _ in PROGRAMS.values())):
        assert text.replace("{robot}", "Pepper") in page
