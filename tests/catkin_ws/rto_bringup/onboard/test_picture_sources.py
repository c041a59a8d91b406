"""A camera that gives no pictures yet, or no more: who watches is told at once, the log when it is worth a line."""

import logging

import pytest
from rto_bringup.onboard.picture_sources import CameraLost, PictureSource


class Patience:
    """As long as a test wants."""

    over = False

    def works(self):
        self.over = True


def asleep():
    raise CameraLost("connection refused")


@pytest.fixture
def lines(caplog):
    caplog.set_level(logging.ERROR)
    return lambda: [record.getMessage() for record in caplog.records]


def test_a_robot_that_starts_meanwhile_is_waited_for_without_a_line(lines, wait_until):
    tries, patience = [], Patience()
    source = PictureSource("camera", lambda: tries.append(1) or asleep(), patience)
    source.watch()
    try:
        wait_until(lambda: len(tries) > 2, "it is asked again")
        assert source.problem == "connection refused" and lines() == []
        patience.over = True
        wait_until(lines, "now it has had its time")
        asked = len(tries)
        wait_until(lambda: len(tries) > asked + 2, "it is asked again")
        assert lines() == ["camera: connection refused; trying again"], "once"
    finally:
        source.close()


def test_a_device_that_is_missing_is_named_at_once(lines, wait_until):
    source = PictureSource("/dev/none", asleep)
    source.watch()
    try:
        wait_until(lines, "it is named")
    finally:
        source.close()
