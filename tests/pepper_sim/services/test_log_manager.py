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
