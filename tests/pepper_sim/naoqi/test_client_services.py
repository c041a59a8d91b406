"""Services of clients as the robot sees them."""

import pytest

from pepper_sim.naoqi.client_services import ClientServices


class _Signal:
    def connect(self, _):
        """Nothing happens here."""


class _Session:
    serviceUnregistered = _Signal()

    def services(self):
        def info(name, machine, *endpoints):
            return {"name": name, "serviceId": len(name), "machineId": machine, "endpoints": list(endpoints)}

        return [
            info("ServiceDirectory", "here", "tcp://127.0.0.1:9559"),
            info("Near", "here", "qi:Near", "tcp://127.0.0.1:1"),
            info("Far", "there", "tcp://127.0.0.1:2", "tcp://192.0.2.1:3"),
        ]

    def service(self, name):
        raise RuntimeError(f"Cannot find service '{name}' in index")


def test_only_addresses_that_lead_to_the_service():
    clients = ClientServices(_Session())
    assert clients.endpoints("Near") == [(4, "tcp://127.0.0.1:1")]
    assert clients.endpoints("Far") == [(3, "tcp://192.0.2.1:3")], "another machine's loopback is not ours"
    assert clients.endpoints("None") == []
    clients.close()


def test_own_services_and_failed_calls():
    clients = ClientServices(_Session())
    clients.remember_own()
    assert clients.is_own("Near") and clients.exists("Far") and not clients.exists("Else")
    with pytest.raises(RuntimeError, match="Cannot find"):
        clients.call("Near", "hello").result(5)
    clients.close()
