"""ALExpressionWatcher over the wire: the three ways of reporting."""

import pytest


@pytest.mark.parametrize(("mode", "told"), [(0, [1, 2, 0]), (1, [1, 0]), (2, [1])])
def test_it_reports(naoqi, wait_until, mode, told):
    memory, received = naoqi.ALMemory, []
    memory.insertData("Test/Watched", 0)
    watched = naoqi.ALExpressionWatcher.add("'Test/Watched'", mode)
    assert (watched.getExpression(), watched.getReportMode()) == ("'Test/Watched'", mode)
    watched.signal.connect(received.append)
    for value in (1, 2, 0):
        memory.insertData("Test/Watched", value)
        assert watched.getValue() == value, "it is evaluated when it is asked"
    wait_until(lambda: received == told, "all was reported")


def test_it_looks_by_itself(naoqi, wait_until):
    received = []
    watched = naoqi.ALExpressionWatcher.add("('FrontTactilTouched' == 1) ~ 0.1", 2)
    watched.signal.connect(received.append)
    naoqi.robot.press("FrontTactil", True)
    wait_until(lambda: received == [True], "the touch has lasted")
    naoqi.robot.press("FrontTactil", False)
