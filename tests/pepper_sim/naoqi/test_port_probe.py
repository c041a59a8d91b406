import functools
import socket

import pytest

from pepper_sim.naoqi.port_probe import PortProbe
from pepper_sim.simulation import Simulation


@pytest.fixture
def watched(request):
    """A quick watch on an endpoint, closed after the test."""

    def make(endpoint):
        watch = PortProbe(endpoint, period=0.05, timeout=0.5)
        request.addfinalizer(watch.close)
        return watch

    return make


def test_a_robot_that_lets_clients_in_is_not_stuck(watched, simulation, wait_until):
    watch = watched(simulation.url)
    wait_until(lambda: watch.knocks >= 5, "five knocks were answered")
    assert not watch.stuck


def test_a_port_that_takes_connections_and_never_answers_is_stuck(watched, wait_until, caplog):
    with socket.create_server(("127.0.0.1", 0)) as door:
        watch = watched(f"tcp://127.0.0.1:{door.getsockname()[1]}")
        wait_until(lambda: watch.stuck, "the watch gives up")
    assert "new clients are not served" in caplog.text


def test_a_port_that_nobody_listens_on_is_stuck(watched, wait_until):
    with socket.create_server(("127.0.0.1", 0)) as door:
        port = door.getsockname()[1]
    watch = watched(f"tcp://127.0.0.1:{port}")
    wait_until(lambda: watch.stuck, "the watch gives up")


def test_a_robot_that_lets_nobody_in_has_to_be_started_anew(monkeypatch, wait_until):
    def refuse(endpoint, timeout):
        raise TimeoutError("nobody opened")

    monkeypatch.setattr("pepper_sim.naoqi.port_probe.knock", refuse)
    monkeypatch.setattr("pepper_sim.simulation.PortProbe", functools.partial(PortProbe, period=0.05))
    with Simulation(scene="empty", port=0) as simulation:
        wait_until(lambda: simulation.failure, "the failure is told")
        assert simulation.failure == f"pepper: {simulation.url} does not let clients in any more"
