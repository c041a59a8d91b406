"""What the launch files of whole stations start, read as roslaunch reads them; nothing is started."""

import re
import xml.etree.ElementTree
from pathlib import Path

import pytest
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

ROOT = Path(__file__).resolve().parent.parent
LAUNCH = ROOT / "launch"
PACKAGES = ROOT / "catkin_ws" / "src"
PASSING_ALL = [
    path for path in sorted(PACKAGES.glob("*/launch/*.launch")) if 'pass_all_args="true"' in path.read_text()
]


def nodes(robot: str, *settings: str) -> dict[str, tuple[str, dict[str, object]]]:
    """Arguments and private parameters of each node, by name."""
    return nodes_of(LAUNCH / f"{robot}.launch", *settings)


def nodes_of(launch_file: Path, *settings: str) -> dict[str, tuple[str, dict[str, object]]]:
    """The same for any launch file."""
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=True).load(str(launch_file), config, argv=list(settings), verbose=False)
    values = {name: parameter.value for name, parameter in config.params.items()}
    return {
        node.name: (
            node.args,
            {
                name.rpartition("/")[2]: value
                for name, value in values.items()
                if name.startswith(f"{node.namespace}{node.name}/")
            },
        )
        for node in config.nodes
    }


OTHERWISE_IN_BOTH = {"drive_server": "pepper_drive_server"}
"""Arguments of one robot's station -> what they are called where both are."""
OF_BOTH_ALONE = {
    "robotino_namespace",  # namespace is Pepper's
    "pepper_drive_port",  # drive_port is Robotino's
    "pepper_drive_server",
    "sim_prefix",  # both.test gives the simulator's viewer a display of its own
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


def arguments(launch_file: Path) -> set[str]:
    """The arguments that can be given to a launch file."""
    found = xml.etree.ElementTree.parse(launch_file).getroot().iterfind("arg")
    return {argument.get("name") for argument in found if argument.get("value") is None}


def wrapped(launch_file: Path) -> list[Path]:
    """The launch files that get all arguments of this one."""
    includes = xml.etree.ElementTree.parse(launch_file).getroot().iter("include")
    files = [include.get("file") for include in includes if include.get("pass_all_args")]
    return [PACKAGES / re.sub(r"\$\(find (\w+)\)", r"\1", file) for file in files]


@pytest.mark.parametrize("wrapper", PASSING_ALL, ids=lambda path: path.stem)
def test_a_wrapper_declares_all_arguments_of_what_it_wraps(wrapper):
    assert wrapped(wrapper)
    for launch_file in wrapped(wrapper):
        assert not arguments(launch_file) - arguments(wrapper), launch_file.name


def test_the_file_of_the_former_driver_takes_what_that_of_the_python_driver_takes():
    python, former = (
        PACKAGES / "pepper_bringup/launch" / f"{name}.launch" for name in ("pepper_full_py", "pepper_full")
    )
    assert arguments(former) == arguments(python)
    asleep = nodes_of(former, "wake_up:=false", "safety:=false", "front_resolution:=1")
    assert asleep == nodes_of(python, "wake_up:=false", "safety:=false", "front_resolution:=1")
    assert asleep["naoqi_driver"][1]["wake_up"] is False and nodes_of(former)["naoqi_driver"][1]["wake_up"] is True


def test_the_station_of_both_robots_takes_what_the_stations_of_each_take():
    of_each = arguments(LAUNCH / "pepper.launch") | arguments(LAUNCH / "robotino.launch")
    wanted = {OTHERWISE_IN_BOTH.get(name, name) for name in of_each} | OF_BOTH_ALONE
    assert arguments(LAUNCH / "both.launch") == wanted


def test_the_simulated_robots_of_both_are_as_the_arguments_say():
    started = nodes("both", "head:=1.8", "people:=standing@1.5,0", "battery:=Li-Ion", "charging:=true", "laser:=true")
    settings = started["robot_control_node"][1]
    assert (settings["head"], settings["people"]) == ("1.8", "standing@1.5,0")
    assert (settings["battery"], settings["charging"], settings["laser"]) == ("Li-Ion", True, True)
    assert started["rto_drive_link"][1]["rank"] == 0
    guarded = nodes("both", "safety:=false", "rank:=3")
    assert guarded["naoqi_driver"][1]["safety"] is False and guarded["rto_drive_link"][1]["rank"] == 3
    assert guarded["robot_control_node"][1]["people"] == ""


@pytest.mark.parametrize("address", ["192.168.0.1", "192.168.0.1:80", "http://192.168.0.1:80", "http://192.168.0.1/"])
def test_the_programs_on_a_robotino_are_looked_for_at_its_address(address):
    settings = (f"hostname:={address}", "gate:=robot", "voice:=true")
    started = nodes_of(PACKAGES / "rto_bringup/launch/rto.launch", *settings)
    addresses = {words[word] for _, words in started.values() for word in ("server", "sender") if word in words}
    assert addresses == {"192.168.0.1:8082", "192.168.0.1:8083", "192.168.0.1:8084"}


def transforms_of(launch_file: Path, *settings: str) -> dict[str, dict[str, str]]:
    """What /tf and /tf_static are replaced by, by the node's name."""
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=True).load(str(launch_file), config, argv=list(settings), verbose=False)
    return {
        node.name: {name: other for name, other in node.remap_args if name in ("/tf", "/tf_static")}
        for node in config.nodes
    }


AROUND = """<launch><remap from="/tf" to="/mine/tf" /><include file="{}" /></launch>"""


@pytest.mark.parametrize(
    ("file", "publishers"),
    [
        ("rto_bringup/launch/rto.launch", ("rto_odometry", "rto_publisher")),
        ("rto_bringup/launch/rto_sim.launch", ("rto_odometry", "rto_publisher")),
        ("pepper_bringup/launch/pepper_full.launch", ("naoqi_joint_states", "pepper_publisher")),
        ("pepper_bringup/launch/tele_pepper.launch", ("naoqi_joint_states", "pepper_publisher")),
        ("pepper_bringup/launch/tele_pepper_ros.launch", ("naoqi_joint_states", "pepper_publisher")),
    ],
)
def test_two_robots_of_a_kind_can_have_transforms_of_their_own(tmp_path, file, publishers):
    own = transforms_of(PACKAGES / file, "tf:=/r2/tf")
    for node in publishers:
        assert own[node] == {"/tf": "/r2/tf", "/tf_static": "/r2/tf_static"}, "all that speak of base_link"
    usual = transforms_of(PACKAGES / file)
    assert not any(usual[node] for node in publishers)
    around = tmp_path / "lab.launch"
    around.write_text(AROUND.format(PACKAGES / file))
    assert all(transforms_of(around)[node] == {"/tf": "/mine/tf"} for node in publishers), "a lab's own remapping holds"


def test_the_line_of_rto_core_starts_our_station_in_the_root_namespace():
    config = ROSLaunchConfig()
    settings = ["robot_ip:=1.2.3.4:80", "max_linear_velocity:=0.2", "robot:=rto-3"]
    XmlLoader().load(str(PACKAGES / "rto_bringup/launch/robot.launch"), config, argv=settings, verbose=False)
    assert {"/rto_core", "/rto_odometry", "/safe_omni_drive"} <= {node.namespace + node.name for node in config.nodes}
    assert {node.namespace for node in config.nodes} == {"/"}
    limits = [config.params[f"/rto_core/max_{kind}_vel"].value for kind in ("linear", "angular")]
    assert limits == [0.2, 0.6]
    assert [node.args for node in config.nodes if node.name == "rto_core"] == ["--hostname 1.2.3.4:80"]


@pytest.mark.parametrize(("namespace", "topic"), [("/", "/safe_cmd_vel"), ("rto3", "rto3/safe_cmd_vel")])
def test_a_simulated_robotino_takes_velocities_in_its_namespace(namespace, topic):
    wired = nodes_of(PACKAGES / "rto_bringup/launch/rto_sim.launch", f"namespace:={namespace}")["robot_control_node"][1]
    assert wired["cmd_vel"] == topic


@pytest.mark.parametrize(
    ("station", "setting", "topics", "space"),
    [
        ("robotino", "namespace:=/", "", "/"),
        ("robotino", "namespace:=rto3", "rto3", "/rto3"),
        ("robotino", "namespace:=/rto3/", "/rto3", "/rto3"),
        ("both", "robotino_namespace:=rto3", "rto3", "/rto3"),
        ("both", "robotino_namespace:=/rto3/", "/rto3", "/rto3"),
    ],
)
def test_no_name_has_an_empty_part_however_the_namespace_is_written(station, setting, topics, space):
    """The page compares names of programs with it: of `//rto3` nobody was told that one had stopped."""
    started = nodes(station, setting)
    assert f" robotino:{space}:img_raw" in started["pilot_page"][0]
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=True).load(str(LAUNCH / f"{station}.launch"), config, argv=[setting], verbose=False)
    wires = "/robot_control_node/wires/robotino"
    for name, topic in (("cmd_vel", "safe_cmd_vel"), ("image", "image_raw")):
        assert config.params[f"{wires}/{name}"].value == f"{topics}/{topic}"
