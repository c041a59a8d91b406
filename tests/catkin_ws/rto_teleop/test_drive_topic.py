"""Where velocities go, in graphs as `rosnode` would list them."""

import pytest
from rto_teleop.drive_topic import Route, find_route, next_route

LEASE = "/rto3/drive_lease"


def graph(*publications, **more):
    """Publishers and subscribers of (node, "pub" or "sub", topic)."""
    publishers, subscribers = {}, {}
    for node, kind, topic in publications:
        (publishers if kind == "pub" else subscribers).setdefault(topic, []).append(node)
    return publishers, subscribers


def gated(namespace, node):
    return [
        (node, "sub", f"{namespace}/safe_cmd_vel"),
        (node, "pub", f"{namespace}/safety"),
        (f"{namespace}/drive_lease", "sub", f"{namespace}/safe_cmd_vel"),
        (f"{namespace}/drive_lease", "pub", f"{namespace}/safe_cmd_vel"),
        ("/rostopic_12_34", "sub", f"{namespace}/safe_cmd_vel"),
    ]


ON_ROBOT = [*gated("/rto3", "/rto3/rto_drive_link"), ("/rto3/rto_drive_link", "sub", "/rto3/cmd_vel")]
HERE = [
    *gated("/rto3", "/rto3/safe_omni_drive"),
    ("/rto3/safe_omni_drive", "pub", "/rto3/cmd_vel"),
    ("/rto3/safe_omni_drive", "sub", "/rto3/cmd_vel"),
    ("/rto3/rto_core", "sub", "/rto3/cmd_vel"),
]
UNGATED = [("/rto3/rto_core", "sub", "/rto3/cmd_vel")]
PEPPER = [("/naoqi_moveto", "sub", "/cmd_vel"), ("/naoqi_moveto", "pub", "/safety")]


@pytest.mark.parametrize("own", ["/rto3/cmd_vel", "/cmd_vel", "/rto3/safe_cmd_vel", "/safe_cmd_vel"])
@pytest.mark.parametrize("station", [ON_ROBOT, HERE], ids=["gate on the robot", "gate here"])
def test_the_gate_is_found_wherever_it_runs(own, station):
    route = find_route(own, graph(*station, *PEPPER))
    (node,) = {node for node, _, topic in station if topic == "/rto3/safety"}
    assert route == Route("/rto3/safe_cmd_vel", (node,), gated=True) and node in route.describe("p")


@pytest.mark.parametrize("own", ["/rto3/cmd_vel", "/cmd_vel"])
def test_without_a_gate_the_driver_listens(own):
    route = find_route(own, graph(*UNGATED))
    assert route == Route("/rto3/cmd_vel", ("/rto3/rto_core",)) and "WITHOUT a safety gate" in route.describe("p")


@pytest.mark.parametrize("own", ["/rto3/cmd_vel", "/cmd_vel"])
@pytest.mark.parametrize("station", [ON_ROBOT, HERE], ids=["gate on the robot", "gate here"])
def test_who_drives_on_cmd_vel_is_told_that_the_gate_hears_it_there(own, station):
    route = find_route(own, graph(*station), gate=False)
    assert route.topic == "/rto3/cmd_vel" and route.gated
    assert "through the safety gate of /rto3/" in route.describe("p") and "rto_core" not in route.describe("p")


def test_a_program_for_the_gate_never_drives_past_it():
    assert find_route("/safe_cmd_vel", graph(*UNGATED)).listeners == ()


def test_in_a_namespace_only_its_robot_is_driven():
    assert find_route("/r1/cmd_vel", graph(*HERE)) == Route("/r1/cmd_vel")


def test_nobody_and_somebody_who_only_watches_are_told_apart_from_a_driver():
    route = find_route("/rto3/cmd_vel", graph(("/rostopic_1_2", "sub", "/rto3/cmd_vel")))
    assert "Nobody listens to /rto3/cmd_vel" in route.describe("p") and "./stack up robotino" in route.describe("p")


def test_one_of_several_robots_must_be_named():
    route = find_route("/cmd_vel", graph(*gated("/r1", "/r1/gate"), *gated("/r2", "/r2/gate")))
    assert not route.listeners
    assert "rosrun rto_teleop rto_teleop_keyboard __ns:=/r2" in route.describe("rto_teleop rto_teleop_keyboard")


@pytest.mark.parametrize("own", ["/rto3/cmd_vel", "/cmd_vel"])
@pytest.mark.parametrize("left", [UNGATED, PEPPER, []], ids=["the driver", "Pepper", "nobody"])
def test_a_gate_that_has_gone_is_waited_for(own, left):
    """It may be starting again: a key that is held meanwhile must not drive past it."""
    gate, found = find_route(own, graph(*HERE)), find_route(own, graph(*left))
    route = next_route(gate, found)
    assert not route.listeners and "Nobody listens to /rto3/safe_cmd_vel" in route.describe("p")
    assert next_route(route, found) == route, "at the next look, too"
    assert next_route(route, gate) == gate, "it is back"


def test_a_gate_that_comes_is_taken():
    gate = find_route("/cmd_vel", graph(*HERE))
    assert next_route(find_route("/cmd_vel", graph(*UNGATED)), gate) == gate


def test_no_other_robot_is_driven_while_a_gate_is_gone():
    both = find_route("/cmd_vel", graph(*HERE, *gated("/r2", "/r2/gate")))
    other = find_route("/cmd_vel", graph(*gated("/r2", "/r2/gate")))
    for before in (find_route("/cmd_vel", graph(*HERE)), both):
        route = next_route(before, other)
        assert route.topic == before.topic and not route.listeners


def test_a_second_gate_must_be_chosen_and_no_driver_takes_its_place():
    both = find_route("/cmd_vel", graph(*HERE, *gated("/r2", "/r2/gate")))
    route = next_route(find_route("/cmd_vel", graph(*HERE)), both)
    assert route.topic == "/cmd_vel", "the first robot is let go"
    assert next_route(route, find_route("/cmd_vel", graph(*UNGATED))) == route and "Say which" in route.describe("p")
