"""One incoming topic on Qt's side."""

import time

from gui.ros.channels import Channel, Incoming


def double(message, arrived):
    if message == "bad":
        raise ValueError("it is bad")
    return message * 2, arrived


def listen(channel):
    heard, troubles = [], []
    channel.arrived.connect(heard.append)
    channel.trouble.connect(troubles.append)
    return heard, troubles


def test_only_the_newest_of_many_messages_is_converted(qt):
    channel = Channel(Incoming("numbers", "numbers", "std_msgs/Int32", double))
    heard, _ = listen(channel)
    before = time.monotonic()
    for number in range(100):
        channel.post(number)
    qt.processEvents()
    assert [value for value, _ in heard] == [198]
    assert before <= heard[0][1] <= time.monotonic()


def test_a_message_that_cannot_be_used_is_said_once(qt):
    channel = Channel(Incoming("numbers", "numbers", "std_msgs/Int32", double))
    heard, troubles = listen(channel)
    for message in ("bad", "bad", 1):
        channel.post(message)
        qt.processEvents()
    assert troubles == ["numbers sends what can't be used: it is bad."] and len(heard) == 1


def test_nothing_arrives_on_a_channel_that_nobody_wants(qt):
    channel = Channel(Incoming("numbers", "numbers", "std_msgs/Int32", double, on_request=True))
    heard, _ = listen(channel)
    channel.post(1)
    qt.processEvents()
    assert heard == []


def test_a_channel_with_a_queue_delivers_all_that_fit_in_order(qt):
    channel = Channel(Incoming("faults", "faults", "std_msgs/Int32", double, queue=3))
    heard, _ = listen(channel)
    for number in range(5):
        channel.post(number)
    qt.processEvents()
    assert [value for value, _ in heard] == [4, 6, 8]
