"""A session as the report brings it up in the window: sign in, Roscore start, Session start, Robot feed."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from window_station import PASSWORD, Desk, Station

from telepresence.station.ros_master import master_answers

SETTINGS = ["microphone_muted", "speaker_muted", "microphone", "speaker"]
PROGRAMS = {
    "/pepper_publisher", "/naoqi_driver", "/pepper_robot/pepper_sonar", "/pepper_robot/pepper_laser",
    "/pepper_robot/pose/pose_manager", "/pepper_robot/camera/front", "/com_cam", "/teleop_twist_keyboard",
}  # fmt: skip
"""The eight of the original."""
STOPPED = "Stopped: the robot's programs have ended"
FEED = "/pepper_robot/camera/front/image_raw"
WATCHED = (
    ("/cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"]),
    ("/drive/state", "telepresence_msgs/DriveState", ["pilot", "stopped_by"]),
    ("/speech", "std_msgs/String", ["data"]),
    ("/joint_states", "sensor_msgs/JointState", ["name", "position"]),
    ("/voice/settings", "telepresence_msgs/VoiceSettings", SETTINGS),
    ("/voice/state", "std_msgs/String", ["data"]),
    ("/com_cam/status", "diagnostic_msgs/DiagnosticStatus", ["message"]),
)
"""Topics whose messages are noted: name, type, fields."""


@dataclasses.dataclass
class Session:
    """The window, and what runs behind it."""

    desk: Desk
    station: Station
    wait_until: Callable

    def sign_in(self) -> None:
        """Open the window if it has ended, and sign in by mouse if nobody is signed in."""
        desk = self.desk
        if desk.window.process.poll() is not None:
            desk.open()
        if desk.signed_in:
            return

        def fill_in() -> None:
            # What is there is replaced: a window that was held up has lost a part of the last try.
            for field, text in (("nameField", "anna"), ("passwordField", PASSWORD)):
                desk.click(field, "signInPage")
                desk.key("ctrl+a")
                desk.screen.do("type", text)

        desk.press_until("signInButton", "signInPage", lambda: "$" in desk.window.terminal_text(), fill_in)
        desk.signed_in = True

    def start_master(self) -> None:
        """Type the robot's address and press Roscore start if there is no master. The programs start, too, and wait for
        the robot."""
        self.sign_in()
        if not master_answers(self.station.master_uri):
            self.type_address()
            self.desk.click("roscoreButton")
            self.wait_until(lambda: master_answers(self.station.master_uri), "a master answers")

    def type_address(self) -> None:
        self.desk.click("address")
        self.desk.key("ctrl+a")
        self.desk.screen.do("type", f"127.0.0.1:{self.station.port}")

    def start_robot(self) -> None:
        """Start the simulated robot, which stands for the real one, if it does not run."""
        self.start_master()
        station = self.station
        if station.robot is None:
            station.robot = station.start(
                "rosrun", "pepper_bringup", "pepper_sim", f"_port:={station.port}", "_scene:=flat"
            )
        if not station.tracking:
            station.start_tracking()
            for topic, kind, fields in WATCHED:
                station.probe("watch", topic, kind, fields)

    def start(self) -> None:
        """Press Session start if the session's programs do not run: it brings them up, too."""
        self.start_robot()
        if not {*self.station.probe("nodes")} & PROGRAMS:
            self.type_address()
            self.desk.click("sessionButton")
        self.wait_until(lambda: {*self.station.probe("nodes")} >= PROGRAMS, "all programs run", timeout=60.0)

    def stop(self) -> None:
        """Press Stop if a program of the session runs."""
        if not {*self.station.probe("nodes")} & PROGRAMS:
            return
        before = self.desk.window.output.count(STOPPED)
        self.desk.click("stopButton")
        self.wait_until(
            lambda: not {*self.station.probe("nodes")} & PROGRAMS, "the session's programs have ended", timeout=60.0
        )
        self.wait_until(lambda: self.desk.window.output.count(STOPPED) > before, "the window says so")

    def show_picture(self) -> None:
        """Press Robot feed if the picture is not asked for; Pepper then takes commands, too."""
        self.start()
        if FEED not in self.station.subscriptions("/gui_ros_node"):
            self.desk.click("feedButton")
        self.wait_until(lambda: "first picture" in self.desk.window.output, "the picture is on the screen")
