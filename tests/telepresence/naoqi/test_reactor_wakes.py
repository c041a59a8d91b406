"""The I/O thread wakes up for whatever is handed to it, however many threads do so at once."""

import threading

from telepresence.naoqi.reactor import Reactor


def test_no_wake_up_is_lost():
    reactor, ran = Reactor(), []

    def hand_over() -> None:
        for number in range(3000):
            reactor.call_soon(ran.append, number)
            if number % 8 == 0:
                reactor.run(int, timeout=5.0)

    threads = [threading.Thread(target=hand_over) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert reactor.run(len, ran, timeout=5.0) == 9000
