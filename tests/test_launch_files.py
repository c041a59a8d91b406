"""What the launch files of whole stations start, read as roslaunch reads them; nothing is started."""

from pathlib import Path

import pytest
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

LAUNCH = Path(__file__).resolve().parent.parent / "launch"


def nodes(robot: str, *settings: str) -> dict[str, tuple[str, dict[str, object]]]:
    """Arguments and private parameters of each node, by name."""
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=True).load(str(LAUNCH / f"{robot}.launch"), config, argv=list(settings), verbose=False)
    values = {name: parameter.value for name, parameter in config.params.items()}
    return {
        node.name: (
            node.args,
            {
                name.rpartition("/")[2]: value
                for name, value in values.items()
                if name.rpartition("/")[0].rpartition("/")[2] == node.name
            },
        )
        for node in config.nodes
    }


@pytest.mark.parametrize("robot", ["pepper", "robotino", "both"])
@pytest.mark.parametrize(
    ("settings", "from_the_beginning"),
    [
        ((), True),  # a simulated robot hears nobody
        (("sim:=false",), False),
        (("sim:=false", "gui:=false"), True),  # nobody could begin it
        (("sim:=false", "conversation:=true"), True),
        (("conversation:=false",), False),
    ],
)
def test_at_a_real_robot_microphone_and_camera_wait_for_a_pilot(robot, settings, from_the_beginning):
    started = nodes(robot, *settings)
    voices = {name: parameters for name, (_, parameters) in started.items() if "conversation" in parameters}
    assert voices and {each["conversation"] for each in voices.values()} == {from_the_beginning}
    if "com_cam" in started:
        assert started["com_cam"][1]["show_on_tablet"] is from_the_beginning
    if "gui_ros_node" in started:
        assert ("--converse" in started["gui_ros_node"][0]) is not from_the_beginning
