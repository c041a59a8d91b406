"""LogManager over the wire."""

import logging


def test_log_messages_reach_the_listeners(naoqi, wait_until):
    messages = []
    listener = naoqi.LogManager.getListener()
    listener.onLogMessage.connect(messages.append)
    logging.getLogger("pepper_sim.test").warning("the floor is %s", "wet")
    wait_until(lambda: messages, "the message arrived")
    message = messages[0]
    assert message["message"] == "the floor is wet" and message["level"] == 3
    assert message["category"] == "pepper_sim.test"
    listener.setLevel(2)
    logging.getLogger("pepper_sim.test").warning("not reported")
    logging.getLogger("pepper_sim.test").error("reported")
    wait_until(lambda: len(messages) == 2, "the error arrived")
    assert messages[1]["message"] == "reported"
