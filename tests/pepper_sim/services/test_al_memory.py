"""ALMemory over the wire, with both clients."""

import pytest
from naoqi_clients import with_both_clients

pytestmark = with_both_clients


def test_data_is_stored_and_read(naoqi):
    memory = naoqi.ALMemory
    for value in (1, 0.5, "text", True, [1, "a", [2.5]], {"a": 1}, None):
        memory.insertData("Test/Key", value)
        assert memory.getData("Test/Key") == value
    memory.insertListData([["Test/A", 1], ["Test/B", "two"]])
    assert memory.getListData(["Test/A", "Test/B"]) == [1, "two"]


def test_a_missing_key_is_an_error_alone_and_none_in_a_list(naoqi, refused):
    memory = naoqi.ALMemory
    assert "Test/Missing" in refused(memory.getData, "Test/Missing")
    assert memory.getListData(["Test/Missing", "DCM/Time"])[0] is None
    memory.insertData("Test/Gone", 1)
    memory.removeData("Test/Gone")
    refused(memory.getData, "Test/Gone")
    refused(memory.removeData, "Test/Gone")


def test_malformed_lists_are_refused(naoqi, refused):
    memory = naoqi.ALMemory
    assert "keyList" in refused(memory.getListData, [1, 2])
    assert "keyList" in refused(memory.getListData, "DCM/Time")
    assert "list" in refused(memory.insertListData, [["only key"]])


def test_the_body_cannot_be_overwritten(naoqi):
    memory = naoqi.ALMemory
    memory.insertData("Device/SubDeviceList/HeadYaw/Position/Sensor/Value", 99.0)
    assert abs(memory.getData("Device/SubDeviceList/HeadYaw/Position/Sensor/Value")) < 1.0


def test_events_reach_every_subscriber_with_their_values(naoqi, connect, wait_until):
    received: dict[str, list] = {"a": [], "b": []}
    subscribers = []  # the object must stay referenced
    for name in received:
        subscriber = connect().service("ALMemory").subscriber("Test/Event")
        subscriber.signal.connect(received[name].append)
        subscribers.append(subscriber)
    for value in (1, "two", [3.0]):
        naoqi.ALMemory.raiseEvent("Test/Event", value)
    wait_until(lambda: all(len(values) == 3 for values in received.values()), "both received three events")
    assert received["a"] == received["b"] == [1, "two", [3.0]]
    assert naoqi.ALMemory.getData("Test/Event") == [3.0]


def test_inserting_data_raises_no_event(naoqi, wait_until):
    received = []
    subscriber = naoqi.ALMemory.subscriber("Test/Quiet")
    subscriber.signal.connect(received.append)
    naoqi.ALMemory.insertData("Test/Quiet", 1)
    naoqi.ALMemory.raiseEvent("Test/Quiet", 2)
    wait_until(lambda: received, "the event arrived")
    assert received == [2]


def test_old_style_callbacks_with_and_without_message(naoqi, connect, wait_until, refused):
    calls = []

    class Module:
        def onEvent(self, name, value, identifier):
            calls.append((name, value, identifier))

    module = Module()
    client = connect()
    number = client.registerService("TestModule", module)
    memory = client.service("ALMemory")
    memory.subscribeToEvent("Test/Old", "TestModule", "onEvent")
    assert memory.getSubscribers("Test/Old") == ["TestModule"]
    naoqi.ALMemory.raiseEvent("Test/Old", 5)
    wait_until(lambda: calls, "the callback was called")
    memory.subscribeToEvent("Test/Old", "TestModule", "message", "onEvent")
    naoqi.ALMemory.raiseEvent("Test/Old", 6)
    wait_until(lambda: len(calls) == 2, "the callback was called again")
    assert calls == [("Test/Old", 5, "TestModule"), ("Test/Old", 6, "message")]
    memory.unsubscribeToEvent("Test/Old", "TestModule")
    assert memory.getSubscribers("Test/Old") == []
    assert "TestModule" in refused(memory.unsubscribeToEvent, "Test/Old", "TestModule")
    assert "Nobody" in refused(memory.subscribeToEvent, "Test/Old", "Nobody", "onEvent")
    client.unregisterService(number)


def test_a_dead_callback_is_dropped(naoqi, connect, wait_until):
    class Module:
        def onEvent(self, *_):
            """Called."""

    client = connect()
    module = Module()
    client.registerService("DyingModule", module)
    client.service("ALMemory").subscribeToEvent("Test/Dying", "DyingModule", "onEvent")
    client.close()

    def dropped():
        naoqi.ALMemory.raiseEvent("Test/Dying", 1)
        return not naoqi.ALMemory.getSubscribers("Test/Dying")

    wait_until(dropped, "the dead module was dropped")


@pytest.mark.parametrize("end", ["dies", "unregisters"])
def test_a_client_that_is_gone_is_called_at_no_event_and_its_extractor_ends(naoqi, connect, wait_until, end):
    """No event comes at which the robot would notice."""

    class Module:
        def onEvent(self, *_):
            """Called."""

    client, module = connect(), Module()
    number = client.registerService("LostModule", module)
    for event in ("FaceDetected", "Test/NeverRaised"):
        client.service("ALMemory").subscribeToEvent(event, "LostModule", "onEvent")
    assert naoqi.ALMemory.getSubscribers("FaceDetected") == ["LostModule"]
    assert [info[0] for info in naoqi.ALFaceDetection.getSubscribersInfo()] == ["LostModule"]
    if end == "dies":
        client.close()
    else:
        client.unregisterService(number)
    wait_until(lambda: naoqi.ALFaceDetection.getSubscribersInfo() == [], "nobody wants faces any more")
    assert naoqi.ALMemory.getSubscribers("FaceDetected") == naoqi.ALMemory.getSubscribers("Test/NeverRaised") == []


@pytest.mark.parametrize("method", ["told", "isValid", "metaObject", "missing"])
def test_a_callback_that_cannot_be_called_is_dropped_and_harms_nobody(qi, naoqi, connect, wait_until, method):
    """Whatever a client subscribes with, whoever raises the event and everybody else who is called notice nothing."""

    class Module:
        def __init__(self):
            self.told = qi.Signal("(m)")
            self.calls = []

        def onEvent(self, name, value, identifier):
            self.calls.append(value)

    event = f"Test/Callable/{method}/{qi.__name__}"
    clients, modules = {name: connect() for name in ("Wrong", "Right")}, {name: Module() for name in ("Wrong", "Right")}
    for name, client in clients.items():
        client.registerService(name, modules[name])
    clients["Wrong"].service("ALMemory").subscribeToEvent(event, "Wrong", method)
    clients["Right"].service("ALMemory").subscribeToEvent(event, "Right", "onEvent")
    raised = []

    def dropped():
        naoqi.ALMemory.raiseEvent(event, len(raised))
        raised.append(len(raised))
        return naoqi.ALMemory.getSubscribers(event) == ["Right"]

    wait_until(dropped, "the wrong one was dropped")
    wait_until(lambda: modules["Right"].calls == raised, "the right one got every event")
    for client in clients.values():
        client.close()


def test_keys_and_events_are_listed(qi, naoqi):
    memory, event = naoqi.ALMemory, f"Test/Declared/{qi.__name__}"
    memory.declareEvent(event, qi.__name__)
    assert memory.getData(event) is None
    memory.raiseEvent(event, 1)
    memory.declareEvent(event, qi.__name__)
    assert memory.getData(event) == 1, "declaring it again keeps the value"
    assert event in memory.getEventList()
    assert memory.getExtractorEvent(qi.__name__) == [event]
    assert set(memory.getDataList("HeadYaw/Position")) == {
        "Device/SubDeviceList/HeadYaw/Position/Actuator/Value",
        "Device/SubDeviceList/HeadYaw/Position/Sensor/Value",
    }
    assert set(memory.getDataList("HeadYaw")) <= set(memory.getDataListName())
    memory.raiseMicroEvent("Test/Micro", 1)
    assert "Test/Micro" in memory.getMicroEventList() and "Test/Micro" not in memory.getEventList()
    assert memory.getType("Test/Micro") == "MicroEvent"
    assert memory.getType("DCM/Time") == "Data"


def test_time_stamps_and_descriptions(naoqi):
    memory = naoqi.ALMemory
    memory.raiseEvent("Test/Stamped", 7)
    value, seconds, microseconds = memory.getTimestamp("Test/Stamped")
    assert value == 7 and seconds > 1.6e9 and 0 <= microseconds < 1_000_000
    assert memory.getEventHistory("Test/Stamped")[-1][0] == 7
    memory.setDescription("Test/Stamped", "a test")
    assert memory.getDescriptionList(["Test/Stamped"]) == [["Test/Stamped", "Event", "a test"]]


def test_new_keys_and_new_types_are_reported(naoqi, wait_until):
    memory, told = naoqi.ALMemory, []
    subscribers = {event: memory.subscriber(f"ALMemory/Key{event}") for event in ("Added", "TypeChanged", "Removed")}
    for event, subscriber in subscribers.items():
        subscriber.signal.connect(lambda key, event=event: told.append((event, key)) if key == "Test/New" else None)
    for value in (1, 2, 2.5, "text"):
        memory.insertData("Test/New", value)
    memory.removeData("Test/New")
    wait_until(lambda: len(told) == 4, "all was reported")
    assert sorted(event for event, _ in told) == ["Added", "Removed", "TypeChanged", "TypeChanged"]


def test_the_next_change_is_waited_for(naoqi):
    memory = naoqi.ALMemory
    memory.insertData("Test/Changing", 1)
    change = memory.getDataOnChange("Test/Changing", 0, _async=True)
    memory.insertData("Test/Changing", 1)
    memory.insertData("Test/Changing", 2)
    assert change.value(20_000) == 2


def test_sensors_are_read_while_the_world_is_busy(naoqi):
    """Between two ticks the last readings are there, and nobody waits for the next one."""
    keys = [f"Device/SubDeviceList/{joint}/Position/Sensor/Value" for joint in ("HeadYaw", "HipPitch")]
    with naoqi.robot.world.locked():
        snapshot = naoqi.robot.snapshot()
        measured = pytest.approx([snapshot.joint_positions[joint] for joint in ("HeadYaw", "HipPitch")], abs=1e-6)
        assert naoqi.ALMemory.getListData(keys) == measured
        assert [naoqi.ALMemory.getData(key) for key in keys] == measured
        assert naoqi.ALMotion.getAngles(["HeadYaw", "HipPitch"], True) == measured
