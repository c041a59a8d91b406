"""ALResourceManager over the wire: lending, asking the owner, waiting."""

import pytest


class Owner:
    """A module that releases what it is asked for."""

    def __init__(self, manager):
        self.asked, self._manager = [], manager

    def release(self, resource: str, owner: str):
        self.asked.append((resource, owner))
        self._manager.releaseResource(resource, owner, _async=True)


@pytest.fixture
def owner(connect):
    session = connect()
    owner = Owner(session.service("ALResourceManager"))
    number = session.registerService("TestOwner", owner)
    yield owner
    session.unregisterService(number)


def test_an_owner_is_asked_and_the_next_one_gets_it(naoqi, owner, refused):
    manager = naoqi.ALResourceManager
    manager.acquireResource("LArm", "TestOwner", "release", 0)
    assert manager.areResourcesOwnedBy(["LArm"], "TestOwner") and not manager.isResourceFree("Arms")
    assert "cannot be had" in refused(manager.acquireResource, "Arms", "ALBattery", "", 0), "an arm of it is lent"
    manager.acquireResource("Arms", "ALBattery", "", 10)
    assert owner.asked == [("LArm", "TestOwner")]
    assert manager.areResourcesOwnedBy(["Arms"], "ALBattery")
    assert not manager.isResourceFree("LArm") and manager.isResourceFree("Head")
    manager.releaseResources(["Arms"], "ALBattery")
    assert manager.areResourcesFree(["Arms", "LArm"])


def test_waiting_ends_with_an_error_and_a_disabled_state_is_nobodys(naoqi, refused):
    manager = naoqi.ALResourceManager
    manager.acquireResource("Head", "ALBattery", "", 0)
    assert "within 0.1 s" in refused(manager.waitForResourcesTree, ["Head"], "ALSonar", "", 100)
    manager.releaseResource("Head", "ALBattery")
    manager.enableStateResource("Standing", False)
    assert "cannot be had" in refused(manager.acquireResource, "Standing", "ALSonar", "", 0)
    manager.enableStateResource("Standing", True)
    assert manager.isInGroup("Arms", "LHand") and not manager.isInGroup("Legs", "LHand")
