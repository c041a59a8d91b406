"""ALKnowledge over the wire: triples, wildcards, metadata, dates."""

import pytest

from pepper_sim.services import al_knowledge as module

LEARNING = "com.aldebaran.learning"
PAST, FUTURE = "2000-01-01T00:00:00Z", "2099-01-01T00:00:00Z"


@pytest.fixture
def knowledge(naoqi):
    service = naoqi.ALKnowledge
    yield service
    service.resetKnowledge("colours")
    service.resetKnowledge(LEARNING)


def test_triples(knowledge, refused):
    for subject, colour in (("sky", "blue"), ("smurf", "blue"), ("sky", "grey")):
        knowledge.add("colours", subject, "hasColor", colour)
    assert knowledge.query("colours", "?", "hasColor", "*") == ["sky", "smurf"]
    assert knowledge.getObject("colours", "sky", "hasColor") == ["blue", "grey"]
    assert knowledge.getSubject("colours", "hasColor", "blue") == ["sky", "smurf"]
    assert knowledge.getPredicate("colours", "sky", "grey") == ["hasColor"]
    knowledge.update("colours", "sky", "hasColor", "red")
    assert knowledge.getObject("colours", "sky", "hasColor") == ["red"]
    knowledge.remove("colours", "*", "*", "blue")
    assert not knowledge.contains("colours", "smurf", "*", "*")
    assert "'?'" in refused(knowledge.query, "colours", "?", "?", "*")


def test_metadata_outlive_their_triple(knowledge):
    assert knowledge.addMetadata("colours", "a", "b", "c", "with", "d") is False
    meal = (LEARNING, "user1", "eat", "pizza")
    knowledge.add(*meal)
    for guest in ("user2", "user3"):
        assert knowledge.addMetadata(*meal, "with", guest) is True
    assert knowledge.queryMetadata(*meal, "with") == ["user2", "user3"]
    assert knowledge.queryTriplet(LEARNING, "*", "eat", "*", "with", "user3") == [list(meal)]
    knowledge.updateMetadata(*meal, "with", "user4")
    assert knowledge.getTripletFromId(LEARNING, knowledge.getId(*meal, "with", "user4")) == list(meal[1:])
    knowledge.remove(*meal)
    assert knowledge.containsMetadata(*meal, "with", "user4") is True
    assert knowledge.queryTripletWithMetadata(*meal, "*", "*", True) == []
    assert knowledge.queryTripletWithMetadata(*meal, "*", "*", False) == [[*meal, "with", "user4"]]


def test_triples_come_and_go_at_their_dates(knowledge):
    meal = (LEARNING, "user1", "eat", "pizza")
    knowledge.addHappeningDate(*meal, FUTURE)
    assert not knowledge.contains(*meal)
    knowledge.updateHappeningDate(*meal, PAST)
    assert knowledge.contains(*meal)
    knowledge.addExpirationDate(*meal, "tomorrow")
    knowledge.updateExpirationDate(*meal, FUTURE)
    assert knowledge.contains(*meal)
    knowledge.updateExpirationDate(*meal, PAST)
    assert not knowledge.contains(*meal)


@pytest.fixture
def small(monkeypatch):
    """A service without a wire that holds little, and how many calls it takes before it refuses one."""
    monkeypatch.setattr(module, "_MOST_BYTES", 100_000)

    def taken(call):
        for number in range(1000):
            try:
                call(f"{number:1000}")
            except module.ServiceError as error:
                assert "full" in str(error)
                return number
        return 1000

    return module.ALKnowledge(), taken


def test_triples_and_their_metadata_take_a_limited_number_of_bytes(small):
    service, taken = small
    meal = (LEARNING, "user1", "eat", "pizza")
    assert 20 < taken(lambda word: service.add("colours", "sky", "hasColor", word)) < 100
    service.resetKnowledge("colours")
    assert 20 < taken(lambda word: service.addMetadata(*meal, "with", word)) < 100
    service.removeMetadata(*meal, "*", "*")
    assert 20 < taken(lambda word: service.add("colours", "sky", "hasColor", word)) < 100, "there is room again"
    service.remove("colours", "*", "*", "*")

    def number(word):
        service.add(LEARNING, "sky", "hasColor", word)
        service.getId(LEARNING, "sky", "hasColor", word, "*", "*")
        service.remove(LEARNING, "sky", "hasColor", word)

    assert 20 < taken(number) < 100, "a number outlives its triple"
    service.resetKnowledge(LEARNING)
    for _ in range(200):
        service.add("colours", "sky", "hasColor", f"{1:1000}")


def test_a_full_knowledge_is_counted_again_only_after_something_was_removed(small, monkeypatch):
    service, taken = small
    held = taken(lambda word: service.add("colours", "sky", "hasColor", word))
    size, counted = module._size, []
    monkeypatch.setattr(module, "_size", lambda words: counted.append(words) or size(words))
    for number in range(10):
        with pytest.raises(module.ServiceError, match="full"):
            service.add("colours", "sea", "hasColor", f"{number:1000}")
        service.add("colours", "sky", "hasColor", f"{number:1000}")  # it is there already
    assert len(counted) == 10, "only what there is no room for"
    service.remove("colours", "sky", "hasColor", f"{0:1000}")
    service.add("colours", "sea", "hasColor", f"{0:1000}")
    assert len(counted) == 10 + 1 + held - 1
