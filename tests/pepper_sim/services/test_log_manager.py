"""LogManager over the wire."""

import logging
import time


def test_log_messages_reach_the_listeners(naoqi, wait_until):
    messages = []
    listener = naoqi.LogManager.getListener()
    listener.onLogMessage.connect(messages.append)
    logging.getLogger("pepper_sim.test").warning("the floor is %s", "wet")
    wait_until(lambda: messages, "the message arrived")
    message = messages[0]
    assert message["message"] == "the floor is wet" and message["level"] == 3
    assert message["category"] == "pepper_sim.test"
    assert list(message) == ["source", "level", "category", "location", "message", "id", "date", "systemDate"]
    assert abs(message["systemDate"] * 1e-9 - time.time()) < 60.0
    listener.setLevel(2)
    logging.getLogger("pepper_sim.test").warning("not reported")
    logging.getLogger("pepper_sim.test").error("reported")
    wait_until(lambda: len(messages) == 2, "the error arrived")
    assert messages[1]["message"] == "reported"


def test_listeners_last_as_long_as_somebody_uses_them(naoqi, simulation, connect, wait_until):
    service = next(s for s in simulation.server.catalogue.services if s.name == "LogManager")
    before, messages = set(service._listeners), []  # other tests', which may go meanwhile
    listener = naoqi.LogManager.getListener()
    listener.onLogMessage.connect(messages.append)
    client = connect()
    others = [client.service("LogManager").getListener() for _ in range(120)]
    for other in others[:10]:
        other.onLogMessage.connect(lambda message: None)

    def left():
        return len(set(service._listeners) - before)

    assert left() == 121
    logging.getLogger("pepper_sim.test").warning("still heard")
    wait_until(lambda: messages, "the oldest listener is told")
    del other, others
    wait_until(lambda: left() == 1, "those that were given back are gone, subscribed or not")
    kept = [client.service("LogManager").getListener() for _ in range(20)]
    kept[0].onLogMessage.connect(lambda message: None)
    assert left() == 21
    client.close()
    wait_until(lambda: left() == 1, "those of a client that has gone are gone, too")


def test_what_alloggers_clients_write_is_in_the_log_and_in_a_file(naoqi, simulation, wait_until):
    messages = []
    listener = naoqi.LogManager.getListener()
    listener.onLogMessage.connect(messages.append)
    logger, file = naoqi.ALLogger, simulation.server.catalogue.disk.path("/home/nao/naoqi/test.log")
    logger.logInFile("test.log")
    logger.warn("MyModule", "careful")
    wait_until(lambda: messages, "the message arrived")
    assert (messages[0]["category"], messages[0]["message"]) == ("pepper_sim.MyModule", "careful")
    logger.setVerbosity("error")
    assert logger.verbosity() == 2
    logger.info("MyModule", "not important enough")
    logger.removeHandler("file")
    logger.setVerbosity("info")
    assert file.read_text() == "careful\n"
