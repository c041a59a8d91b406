"""Which stream a viewer gets, by invented figures and time."""

from telepresence.page.stream_choice import FIRST_TRY, PATIENCE, StreamChoice


class Network:
    """Carries so many bits a second; what is more waits for `queue` seconds in it, and then is lost."""

    def __init__(self, carries, queue=0.2, loses=0.0):
        self.carries, self.queue, self.loses = carries, queue, loses
        self.choice, self.now = StreamChoice(), 100.0

    def watch(self, seconds):
        for _ in range(round(10 * seconds)):
            rate = 350_000 if self.choice.small else 1_500_000
            self.now += 0.1
            full = rate > self.carries
            lost = max(self.loses, 1.0 - self.carries / rate if full and self.queue < 1.0 else 0.0)
            self.choice.choose(lost, 0.05 + (self.queue if full else 0.0), self.now)
        return self.choice.small


def test_a_good_network_gets_the_large_pictures():
    assert not Network(20e6).watch(600.0)


def test_a_radio_that_loses_a_few_gets_the_large_pictures():
    assert not Network(20e6, loses=0.05).watch(600.0)


def test_who_has_not_reported_yet_gets_the_large_pictures():
    choice = StreamChoice()
    assert not any(choice.choose(None, None, 0.1 * step) for step in range(600))


def test_a_network_that_loses_nothing_and_comes_late_gets_the_small_ones():
    network = Network(20e6, queue=2.0)
    network.watch(5.0)
    network.carries = 1e6
    assert network.watch(PATIENCE + 1.0)


def test_a_bad_network_soon_gets_the_small_ones():
    network = Network(1e6)
    assert not network.watch(PATIENCE - 1.0)
    assert network.watch(4.0)


def test_one_bad_second_changes_nothing():
    network = Network(20e6)
    network.watch(5.0)
    network.carries = 1e6
    network.watch(PATIENCE - 1.0)
    network.carries = 20e6
    assert not network.watch(10.0)


def test_the_large_ones_are_tried_again_ever_less_often():
    network = Network(1e6)
    network.watch(10.0)
    tries, was = [], True
    for _ in range(3000):
        small = network.watch(0.1)
        if was and not small:
            tries.append(network.now)
        was = small
    assert 2 <= len(tries) <= 4 and tries[1] - tries[0] > FIRST_TRY
    network.carries = 20e6
    assert not network.watch(400.0)


def test_who_wants_the_small_ones_has_them_until_it_does_not():
    choice = StreamChoice()
    assert choice.choose(0.0, 0.05, 1.0, wanted=True)
    assert not choice.choose(0.0, 0.05, 3.5)
