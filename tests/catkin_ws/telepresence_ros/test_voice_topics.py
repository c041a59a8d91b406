"""What a person has silenced stays silent: the node `rto_voice`, without a robot and without a sound card."""

from __future__ import annotations

import pytest

from telepresence.station.ros_master import master_proxy

pytestmark = pytest.mark.ros

SETTINGS = ["microphone_muted", "speaker_muted", "speaker"]


@pytest.fixture
def probe(graph):
    probe = graph.probe()
    probe.watch("/voice/settings", "telepresence_msgs/VoiceSettings", SETTINGS)
    probe.watch("/voice/state", "std_msgs/String", ["data"])
    return probe


@pytest.fixture
def start(graph, probe, wait_until):
    def start(*parameters):
        probe.forget("/voice/settings")
        probe.forget("/voice/state")
        program = str(graph.workspace / "lib/rto_node/rto_voice")
        node = graph.run(program, f"_server:=127.0.0.1:{graph.free_port()}", *parameters)
        wait_until(lambda: probe.seen("/voice/settings") and probe.seen("/voice/state"), "it runs")
        return node

    return start


def test_a_node_that_dies_comes_back_as_silent_as_it_was(graph, probe, start, wait_until):
    first = start()
    before = probe.newest("/voice/settings")
    assert before[:2] == [False, False] and before[2] != "none"
    for name, wanted in (("mute_microphone", True), ("mute_speaker", True), ("conversation", False)):
        assert probe.call(f"/voice/{name}", "std_srvs/SetBool", {"data": wanted})[0]
    chosen = graph.run("rostopic", "pub", "/voice/speaker", "std_msgs/String", "data: none")
    wait_until(lambda: probe.newest("/voice/settings")[2] == "none", "a loudspeaker is chosen")
    chosen.kill()
    first.kill()
    second = start()
    wait_until(lambda: probe.newest("/voice/settings") == [True, True, "none"], "muted, on the device that was chosen")
    assert probe.newest("/voice/state") == ["no conversation"]
    assert second.end() == 0
    third = start()
    assert probe.newest("/voice/settings") == before, "one that ends forgets it"
    assert third.end() == 0


def test_a_node_that_dies_comes_back_with_the_conversation_that_was_begun(probe, start):
    first = start("_conversation:=false")
    assert probe.newest("/voice/state") == ["no conversation"]
    assert probe.call("/voice/conversation", "std_srvs/SetBool", {"data": True})[0]
    first.kill()
    second = start("_conversation:=false")
    assert probe.newest("/voice/state") != ["no conversation"]
    assert second.end() == 0


@pytest.mark.parametrize(
    ("kept", "parameters", "muted", "conversation"),
    [
        (
            {"conversation": True, "microphone_muted": False},
            ("_conversation:=false", "_push_to_talk:=true"),
            True,
            False,
        ),
        (
            {"conversation": False, "microphone_muted": True},
            ("_conversation:=true", "_push_to_talk:=false"),
            True,
            False,
        ),
    ],
)
def test_a_killed_session_makes_the_next_one_quieter_and_never_louder(
    graph, probe, start, kept, parameters, muted, conversation
):
    master_proxy(graph.uri).setParam("/test", "/rto_voice/kept", {**kept, "session": "another one's"})
    node = start(*parameters)
    assert probe.newest("/voice/settings")[0] is muted
    assert (probe.newest("/voice/state") != ["no conversation"]) is conversation
    assert node.end() == 0
