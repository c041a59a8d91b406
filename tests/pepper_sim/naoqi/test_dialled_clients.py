"""A robot that connects to its clients to call their services, as an ordinary Pepper does."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import qi

from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.service import ServiceError
from pepper_sim.naoqi.tasks import Alarm
from telepresence.naoqi.server import Server
from telepresence.naoqi.session import Session


class Ears:
    def __init__(self) -> None:
        self.taken: list[int] = []

    def take(self, number: int) -> int:
        self.taken.append(number)
        return len(self.taken)


@pytest.fixture
def clients() -> Iterator[ClientServices]:
    alarm, server = Alarm(), Server("tcp://127.0.0.1:0")
    server.start()
    clients = ClientServices(server, alarm)
    clients.dial()
    yield clients
    clients.close()
    server.close()
    alarm.close()


@pytest.mark.parametrize("library", [qi.Session, Session], ids=["the vendor's", "ours"])
def test_clients_are_called_where_they_listen(clients, library) -> None:
    ears, session = Ears(), library()
    session.connect(clients.url)
    session.listen("tcp://127.0.0.1:0")
    session.registerService("Ears", ears)
    assert clients.call("Ears", "take", 0).result(30) == 1
    clients.post("Ears", "take", 1)
    assert clients.call("Ears", "take", 2).result(30) == 3
    session.close()


@pytest.mark.parametrize("announced", [False, True], ids=["that announces none", "that is not there"])
def test_a_client_is_not_found_without_an_address(clients, announced) -> None:
    session = Session()
    session.connect(clients.url)
    if announced:
        session.listen("tcp://127.0.0.1:0")
    session.registerService("Ears", Ears())
    for listener in session._listeners:
        listener.close()
    with pytest.raises(ServiceError, match="Can't find service: Ears"):
        clients.reach("Ears").result(30)
    with pytest.raises(ServiceError, match="Can't find service: Mouth"):
        clients.reach("Mouth").result(30)
    session.close()
