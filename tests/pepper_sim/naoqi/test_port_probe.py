import functools
import socket

import pytest

from pepper_sim.naoqi.port_probe import PortProbe
from pepper_sim.simulation import Simulation


@pytest.fixture
def make_probe(request):
    """Make a quick probe of an endpoint, closed after the test."""

    def make(endpoint):
        probe = PortProbe(endpoint, period=0.05, timeout=0.5)
        request.addfinalizer(probe.close)
        return probe

    return make


def test_a_port_that_accepts_clients_is_not_stuck(make_probe, simulation, wait_until):
    probe = make_probe(simulation.url)
    wait_until(lambda: probe.answered >= 5, "five probes were answered")
    assert not probe.stuck


def test_a_port_that_accepts_connections_and_never_answers_is_stuck(make_probe, wait_until, caplog):
    with socket.create_server(("127.0.0.1", 0)) as server:
        probe = make_probe(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        wait_until(lambda: probe.stuck, "the probe gives up")
    assert "new clients are not served" in caplog.text


def test_a_port_that_nobody_listens_on_is_stuck(make_probe, wait_until):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    probe = make_probe(f"tcp://127.0.0.1:{port}")
    wait_until(lambda: probe.stuck, "the probe gives up")


def test_a_robot_that_accepts_no_clients_has_to_be_restarted(monkeypatch, wait_until):
    def refuse(endpoint, timeout):
        raise TimeoutError("no answer")

    monkeypatch.setattr("pepper_sim.naoqi.port_probe.probe", refuse)
    monkeypatch.setattr("pepper_sim.simulation.PortProbe", functools.partial(PortProbe, period=0.05))
    with Simulation(scene="empty", port=0) as simulation:
        wait_until(lambda: simulation.failure, "the failure is reported")
        assert simulation.failure == f"pepper: {simulation.url} accepts no clients any more"
