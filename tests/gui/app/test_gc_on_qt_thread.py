import gc
import threading
import weakref

import pytest

from gui.app.gc_on_qt_thread import GcOnQtThread


class Cycle:
    def __init__(self, died_on):
        self.itself = self
        weakref.finalize(self, lambda: died_on.append(threading.current_thread()))


@pytest.fixture
def collector(qt):
    collector = GcOnQtThread()
    yield collector
    collector.close()


def make_many():
    return [[] for _ in range(5000)]


def test_cycles_die_on_qts_thread_whoever_makes_objects(collector):
    died_on = []
    Cycle(died_on)
    thread = threading.Thread(target=make_many)
    thread.start()
    thread.join()
    kept = make_many()
    assert died_on == []
    collector.collect()
    assert died_on == [threading.main_thread()] and kept


def test_it_collects_by_itself(collector, spin):
    died_on = []
    Cycle(died_on)
    kept = make_many()
    spin(lambda: died_on, "the cycle is found")
    assert kept


def test_python_collects_again_after_it_is_closed(qt):
    GcOnQtThread().close()
    assert gc.isenabled()
