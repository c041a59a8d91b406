"""Calls of drive_lease while it hangs. The services stand for the network; no ROS graph."""

import asyncio
import threading
import time

import pytest
from pilot_page import lease_services
from pilot_page.lease_services import LeaseServices
from telepresence_msgs.srv import DriveAskRequest, DriveAskResponse

pytestmark = pytest.mark.ros


class HangingLease:
    resolved_name = "/drive/ask"

    def __init__(self):
        self.asked, self.goes_on = [], threading.Event()

    def wait_for_service(self, timeout):
        pass

    def __call__(self, request):
        self.asked.append(request.action)
        assert self.goes_on.wait(10.0)
        return DriveAskResponse(ok=True)


def test_what_waited_for_a_lease_that_hung_is_not_asked_any_more_but_to_stop(monkeypatch, wait_until):
    monkeypatch.setattr(lease_services, "TIMEOUT", 0.2)
    lease, answers = HangingLease(), []
    loop = asyncio.new_event_loop()
    services = LeaseServices(loop, "/")
    services._ask = lease

    def ask(action):
        services.call_ask(DriveAskRequest(action=action), lambda answer: answers.append((action, answer)))

    for _ in range(lease_services._THREADS):
        ask("present")
    wait_until(lambda: len(lease.asked) == lease_services._THREADS, "all are under way")
    for action in ("take", "reset_stop", "stop"):
        ask(action)
    time.sleep(lease_services.TIMEOUT + 0.1)
    lease.goes_on.set()
    services._threads.shutdown()
    loop.run_until_complete(asyncio.sleep(0))
    loop.close()
    assert lease.asked == [*lease_services._THREADS * ["present"], "stop"]
    late = {action: answer for action, answer in answers if not answer.ok}
    assert set(late) == {"take", "reset_stop"} and all("in time" in answer.text for answer in late.values())
    assert len(answers) == lease_services._THREADS + 3
