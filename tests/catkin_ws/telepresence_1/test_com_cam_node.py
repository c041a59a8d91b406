"""What com_cam does for a tablet that was told to show the page and never asks for its picture."""

from __future__ import annotations

from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from telepresence_1 import com_cam_node
from telepresence_1.com_cam_node import VISIT_PATIENCE, ComCam

UNVISITED = "the tablet does not ask for the picture"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Time, which a test sets."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(com_cam_node, "time", SimpleNamespace(monotonic=lambda: clock.now))
    return clock


@pytest.fixture
def warnings(monkeypatch: pytest.MonkeyPatch) -> Mock:
    warnings = Mock()
    monkeypatch.setattr(com_cam_node.rospy, "logwarn", warnings)
    return warnings


@pytest.fixture
def com_cam(clock: SimpleNamespace) -> ComCam:
    """The node without ROS, camera and robot; its page is on the tablet, and nobody has asked for the picture."""
    com_cam = ComCam.__new__(ComCam)
    com_cam.link = Mock(shown_since=clock.now, wanted=True, problem="", focus=SimpleNamespace(problem=""))
    com_cam.stream = Mock(viewers=0)
    com_cam.page_url = "http://10.0.0.7:10002/?k=secret"
    com_cam._visited, com_cam._unvisited = clock.now, False
    return com_cam


def test_the_page_is_loaded_anew_until_somebody_looks(com_cam, clock, warnings):
    com_cam._reload_unvisited_page()
    assert not com_cam.link.reload.called and com_cam._describe_tablet() == "on the tablet"
    for periods in (1, 2):
        clock.now += VISIT_PATIENCE + 1.0
        com_cam._reload_unvisited_page()
        assert com_cam.link.reload.call_count == periods and com_cam._describe_tablet() == UNVISITED
    assert warnings.call_count == 1 and "secret" not in str(warnings.call_args)
    com_cam.stream.viewers = 1
    com_cam._reload_unvisited_page()
    assert com_cam.link.reload.call_count == 2 and com_cam._describe_tablet() == "on the tablet"


def test_a_page_that_is_not_shown_is_not_missed(com_cam, clock, warnings):
    com_cam.link.shown_since, com_cam.link.problem = None, "no tablet"
    clock.now += VISIT_PATIENCE + 1.0
    com_cam._reload_unvisited_page()
    assert not com_cam.link.reload.called and com_cam._describe_tablet() == "not on the tablet: no tablet"
    com_cam.link.shown_since = clock.now
    com_cam._reload_unvisited_page()
    assert not com_cam.link.reload.called, "its time begins when it is shown"


def test_to_ask_how_things_stand_changes_nothing(com_cam, clock, warnings):
    clock.now += VISIT_PATIENCE + 1.0
    before = dict(vars(com_cam))
    assert com_cam._describe_tablet() == "on the tablet"
    assert vars(com_cam) == before and not com_cam.link.reload.called and not warnings.called
