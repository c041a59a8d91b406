from telepresence.security.change_log import PERIOD, ChangeLog


def test_what_changes_with_every_answer_is_logged_once_a_second():
    lines = []
    log = ChangeLog()
    for step in range(100):
        log.note(100.0 + 0.05 * step, f"problem {step}", lambda _form, text: lines.append(text))
    assert len(lines) == 5 and lines[0] == "problem 0"


def test_the_last_state_is_logged_late_rather_than_never():
    lines = []

    def write(_form, text):
        lines.append(text)

    log = ChangeLog("fine")
    log.note(100.0, "fine", write)
    log.note(100.1, "lost", write)
    for _ in range(2):
        log.note(100.2, "fine", write)
    assert lines == ["lost"]
    log.note(100.2 + PERIOD, "fine", write)
    log.note(105.0, "fine", write)
    assert lines == ["lost", "fine"]
    log.repeat()
    log.note(107.0, "fine", write)
    assert lines[2:] == ["fine"]
