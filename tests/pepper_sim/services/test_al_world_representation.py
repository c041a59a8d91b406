"""ALWorldRepresentation over the wire: a tree of places, attributes, conditions, the disk."""

import math

import pytest


@pytest.fixture
def world(naoqi):
    service = naoqi.ALWorldRepresentation
    assert service.createObjectCategory("Toys", True) == 0
    assert service.addAttributeToCategory("Toys", "Looks", [["Colour", "string"], ["Age", "int"]]) == 0
    yield service
    service.removeObjectCategory("Toys")


def test_places_follow_their_parents(world):
    quarter = math.pi / 2
    assert world.storeObject("Table", "World", [2.0, 0.0, 0.7, 0.0, 0.0, quarter], "Toys", []) == 0
    assert world.storeObject("Ball", "Table", [1.0, 0.0, 0.1, 0.0, 0.0, 0.0], "Toys", []) == 0
    assert world.getPosition6D("World", "Ball") == pytest.approx([2.0, 1.0, 0.8, 0.0, 0.0, quarter], abs=1e-6)
    assert world.getPosition6D("Ball", "Table") == pytest.approx([-1.0, 0.0, -0.1, 0.0, 0.0, 0.0], abs=1e-6)
    turn, place = world.getPosition("World", "Ball")
    assert turn == pytest.approx([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)], abs=1e-6) and place[1] == pytest.approx(
        1.0
    )
    assert world.updatePositionWithReference("Ball", "World", [2.0, 0.0, 0.8, 0.0, 0.0, 0.0], True) == 0
    assert world.getPosition6D("World", "Ball") == pytest.approx([2.0, 0.0, 0.8, 0.0, 0.0, 0.0], abs=1e-6)
    assert world.getPosition6DAtTime("World", "Ball", 3600, 0)[1] == pytest.approx(1.0, abs=1e-6)
    assert world.getPosition6D("World", "Nothing") == [0.0] * 6
    assert world.clearObject("Table") == 0 and not world.findObject("Ball"), "what is on it goes with it"
    assert world.storeObject("Ball", "Nowhere", [0.0] * 6, "Toys", []) != 0


def test_attributes_are_found_by_conditions(world, refused):
    for name, colour, age in (("Ball", "red", 42), ("Box", "blue", 3)):
        looks = [["Looks", [["Colour", colour], ["Age", age]]]]
        assert world.storeObject(name, "World", [0.0] * 6, "Toys", looks) == 0
    assert world.select("Age > 10 AND Colour = 'red'", "Toys", "Looks", "*") == [["red", 42]]
    assert world.selectWithOrder("", "Age ASC", "Toys", "Looks", "Age, Colour") == [[3, "blue"], [42, "red"]]
    world.storeObjectAttribute("Ball", "Looks", [["Age", 43]])
    assert world.getObjectAttributeValues("Ball", "Looks", 1) == [[None, 43]]
    world.updateAttribute("Ball", "Looks", "Age = 43", [["Colour", "faded"]])
    assert world.getObjectLatestAttributes("Ball", 5) == [["Looks", [["faded", 43], ["red", 42]]]]
    world.deleteObjectAttribute("Ball", "Looks", "Age = 43")
    assert world.getObjectAttributes("Ball") == [["Looks", "(Colour string, Age int)"]]
    assert world.save() == 0 and world.clearObject("Ball") == 0 and world.load() == 0
    assert world.getObjectAttributeValues("Ball", "Looks", 9) == [["red", 42]]
    endless = "1 IN (WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT count(*) FROM n)"
    for criterion in ("nonsense here", "1); DROP TABLE x; --", "load_extension('x')", endless):
        assert "criterion" in refused(world.select, criterion, "Toys", "Looks", "*")
