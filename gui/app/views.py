"""Connects one robot's channels to the widgets that show them, and clicks on the picture to driving on the floor."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from PyQt5.QtCore import QObject, Qt, pyqtSignal
from PyQt5.QtGui import QPainter

from gui.driving.delay_speed_limit import HALF_FROM, DelaySpeedLimit
from gui.driving.floor_drive import FloorDrive
from gui.driving.floor_overlay import PixelToWidget, paint_path
from gui.driving.picture_age import PictureAge
from gui.driving.round_trip import RoundTrip
from gui.periodic_timer import PeriodicTimer
from gui.ros.channels import Answer
from gui.ros.link_state import LinkState
from gui.ros.picture import Picture
from gui.ros.readings import BodyState, CameraView, DriveState, Lens, PageState, PostureResult, Safety
from gui.ros.service_switch import ServiceSwitch
from gui.widgets.label import tip
from telepresence.security.outside_text import clean
from telepresence.teleop.camera_view import NO_PICTURE, camera_view
from telepresence.teleop.floor_projection import scaled_to

if TYPE_CHECKING:
    from gui.driving.drive_access import DriveAccess
    from gui.ros.link import RosLink
    from gui.window import OperatorWindow

READINGS = (
    "body", "safety", "careful", "laser", "infrared", "sonar_front", "sonar_back", "bumper", "battery", "drive_state",
    "voice_levels", "voice_state", "voice_settings", "posture", "true_pose",
)  # fmt: skip
"""Channels whose readings are passed to the widgets unchanged."""
LONGEST_STATE = 20
"""Characters of the driver's state beside the view from above."""
AGE_PERIOD = 250  # ms
LIMIT_PERIOD = 100  # ms
TALK_PERIOD = 500  # ms between two calls while Hold to talk is held, for a program that ends it without them
CAMERA_PERIOD = 50  # ms between two looks whether the camera's program is still connected
OTHER_CLOCK = (
    "The camera's clock is not this machine's, so nobody can tell how late its pictures are: drive slowly, or set the "
    "clocks."
)


class Views(QObject):
    """Shows what one robot publishes, and passes on what is asked of it: only of whoever has it.

    Attributes:
        floor_drive: Input device that drives to the place the pilot points at; to be added to the `InputMux`.
    """

    said = pyqtSignal(str, str)
    """A message for the pilot, and its level."""
    share_changed = pyqtSignal(float)
    """The share of the speed that the link's delay allows, 0 to 1."""

    def __init__(self, window: OperatorWindow, link: RosLink, access: DriveAccess) -> None:
        super().__init__(window)
        self._window, self._link, self._access = window, link, access
        self.robot = link.robot
        self._lens: Lens | None = None
        self._more: Callable[[QPainter, float, float], None] | None = None
        self._body: BodyState | None = None
        self._round_trip, self._delay_limit, self._share = RoundTrip(), DelaySpeedLimit(), 1.0
        self._picture_age, self._other_clock = PictureAge(), False
        self.floor_drive = FloorDrive(self._view, window.video.age, self.robot.farthest, self)
        self._readers = (
            window.around, window.bodyPanel, window.gate, window.health, window.sound, self.floor_drive,
        )  # fmt: skip
        window.around.set_robot(self.robot.outline, self.robot.top_speed, self.robot.reach)
        window.robotPanel.set_robot(self.robot.speaks, self.robot.postures)
        for page, wanted in (
            (window.robotPage, self.robot.speaks or bool(self.robot.postures)), (window.tabletPage, link.has("tablet")),
            (window.soundPage, link.has("voice_state")),
        ):  # fmt: skip
            if not wanted:
                window.deck.removeTab(window.deck.indexOf(page))
        if self.robot.by_movement:
            window.around.hide()
            window.aroundTitle.setText("Body")
            window.gate.hide()
        for name in READINGS:
            if link.has(name):
                link.channel(name).arrived.connect(self.show_reading)
        if link.has("lens"):
            link.channel("lens").arrived.connect(self._on_lens)
        if link.has("page"):
            link.channel("page").arrived.connect(self._show_page)
        if link.has("tablet"):
            link.channel("tablet").arrived.connect(self._show_tablet)
            window.deck.currentChanged.connect(lambda _index: self._watch_tablet())
        link.channel("picture").arrived.connect(self._on_picture)
        self._age_timer = PeriodicTimer(AGE_PERIOD, self._show_age, self)
        window.video.stale_changed.connect(self._on_stale)
        window.video.late_changed.connect(lambda _late: self._show_share())
        self._limit_timer = PeriodicTimer(LIMIT_PERIOD, self._update_share, self)
        self._cameras = 0
        self._camera_timer = PeriodicTimer(CAMERA_PERIOD, self._look_for_camera, self)
        self._camera_timer.start()
        self._limit_timer.start()
        self._offer_cameras()
        self._join_panels()
        self._join_picture()

    def watch_picture(self, wanted: bool) -> None:
        """Receive the calibration that belongs to the picture, or stop doing so."""
        if self._link.has("lens"):
            self._link.watch("lens", wanted)
        self._begin_feed()
        if not wanted:
            self._window.health.clear_picture()

    def note_sent(self) -> None:
        """Note that a command that moves the robot has been sent."""
        self._round_trip.sent(time.monotonic())

    def forget_sent(self) -> None:
        """Expect no answer to what was sent: what took it may have died, and a dead program is no slow link."""
        self._round_trip.forget()

    def show_reading(self, reading: object) -> None:
        """Pass a reading to every widget that shows its kind."""
        for reader in self._readers:
            reader.show_reading(reading)
        if isinstance(reading, BodyState):
            self._body = reading
        elif isinstance(reading, Safety):
            self._show_round_trip(reading)
            if self.floor_drive.target is not None:
                self._window.video.update()
        elif isinstance(reading, DriveState):
            # The whole text would widen the column.
            self._window.aroundLabel.setText(clean(reading.text.partition(":")[0], LONGEST_STATE))
            self._window.aroundLabel.setToolTip(reading.text)
        elif isinstance(reading, PostureResult):
            text = "Done." if reading.ok else f"The robot did not do it: {reading.text or 'it gave no reason'}."
            self._window.robotPanel.answer(text)

    def _show_round_trip(self, safety: Safety) -> None:
        taken = self._round_trip.answered(safety.command_age, safety.arrived)
        waiting = self._round_trip.waiting(safety.arrived)
        if taken is None and waiting > HALF_FROM:
            taken = waiting  # the round trip takes at least that long
        if taken is not None:
            self._delay_limit.note_command(taken, safety.arrived)
            self._window.health.show_round_trip(taken)

    def _update_share(self) -> None:
        share = self._delay_limit.share(time.monotonic())
        if share != self._share:
            self._share = share
            if not share:
                self._round_trip.forget()  # no commands are sent from now on
            self._show_share()
            self.share_changed.emit(share)

    def _show_share(self) -> None:
        self._window.health.show_share(0.0 if self._window.video.late else self._share)

    # --- speech, postures, sound ---

    def _join_panels(self) -> None:
        panel, sound, link = self._window.robotPanel, self._window.sound, self._link
        panel.say.connect(self._say)
        panel.posture.connect(self._take_posture)
        for name, signal, quiet, show, repeat in (
            ("mute_microphone", sound.mute_microphone, True, self._on_mute_answer, 0),
            ("mute_speaker", sound.mute_speaker, True, self._on_mute_answer, 0),
            ("talk", sound.talk, False, self._show_refusal, TALK_PERIOD),
            ("set_careful", self._window.gate.careful_wanted, True, self._show_answer, 0),
        ):
            if link.has(name):
                switch = ServiceSwitch(link, name, quiet, self, repeat)
                signal.connect(partial(self._turn, switch, None if name == "set_careful" else quiet))
                switch.answered.connect(show)
                switch.late.connect(lambda text: self.said.emit(text, "warn"))
        for name, signal in (("microphone", sound.microphone_chosen), ("speaker", sound.speaker_chosen)):
            if link.has(name):
                signal.connect(partial(self._choose_device, name))

    def _refusal(self) -> str:
        """Why nothing is asked of the robot by this window; empty when it has the robot."""
        return "" if self._access.mine else self._access.obstacle()

    def _turn(self, switch: ServiceSwitch, silent: bool | None, wanted: bool) -> None:
        """Turn a switch. To its `silent` position anybody may: nobody is heard against their will."""
        refusal = self._refusal()
        if refusal and wanted is not silent:
            self._window.sound.show_settings()
            self.said.emit(refusal, "warn")
        else:
            switch.turn(wanted)

    def _say(self, text: str) -> None:
        panel, refusal = self._window.robotPanel, self._refusal()
        if self._link.state.driver and refusal:
            panel.refuse(text, refusal)
        elif not self._link.state.master:
            panel.refuse(text, "There is no ROS master, so the robot cannot say this. Press Roscore start.")
        elif not self._link.is_heard("say") or not self._link.send("say", text):
            panel.refuse(text, f"No program listens to {self._link.resolve('speech')}, so the robot does not say this.")

    def _take_posture(self, name: str) -> None:
        panel, refusal = self._window.robotPanel, self._access.obstacle()
        title = dict(self.robot.postures)[name]
        panel.answer(f"{title} …")
        if self._link.state.driver and refusal:  # that of the red stop, too: the robot moves
            panel.answer(refusal)
        elif name in ("wakeup", "rest"):
            self._link.call(name, then=lambda answer: panel.answer("Done." if answer.ok else answer.text))
        elif not self._link.state.master:
            panel.answer("There is no ROS master. Press Roscore start.")
        elif not self._link.is_heard("posture") or not self._link.send("posture", name):
            panel.answer("No program of the robot takes postures: pose_manager does not run, or is not ready yet.")

    def _choose_device(self, name: str, device: str) -> None:
        if refusal := self._refusal():
            self.said.emit(refusal, "warn")
        else:
            self._link.send(name, device)

    def _show_answer(self, answer: Answer) -> None:
        self.said.emit(answer.text, "info" if answer.ok else "warn")

    def _on_mute_answer(self, answer: Answer) -> None:
        if not answer.ok:
            self._window.sound.show_settings()  # a button that was pressed in vain looks as if it had done it
        self._show_refusal(answer)

    def _show_refusal(self, answer: Answer) -> None:
        if not answer.ok:
            self.said.emit(answer.text, "warn")

    # --- pictures ---

    def _join_picture(self) -> None:
        if not self._link.has("lens"):
            return
        video, drive = self._window.video, self.floor_drive
        video.set_overlay(self._paint_over)
        video.setCursor(Qt.CursorShape.CrossCursor)
        video.setToolTip("Hold the left button on the floor to drive there")
        drive.target_changed.connect(self._window.around.show_target)
        drive.target_changed.connect(lambda _target: video.update())
        drive.refused.connect(lambda reason: self.said.emit(reason, "warn"))
        drive.resumed.connect(lambda: self.said.emit("Driving on to where you point.", "good"))

    def _offer_cameras(self) -> None:
        choice = self._window.cameraChoice
        choice.clear()
        for name, topic in self.robot.cameras:
            self._offer_camera(name, topic)
        if self.robot.cameras and self._link.feed not in [self._link.resolve(topic) for _, topic in self.robot.cameras]:
            choice.insertItem(0, "Other", self._link.feed)
        choice.setCurrentIndex(0)
        choice.setVisible(bool(self.robot.cameras))
        self._window.feedLabel.setVisible(not self.robot.cameras)
        choice.activated.connect(lambda index: self._change_camera(choice.itemData(index)))
        self._link.state_changed.connect(self._offer_simulators_camera)

    def _offer_camera(self, name: str, topic: str) -> None:
        choice = self._window.cameraChoice
        choice.addItem(name, topic)
        choice.setItemData(choice.count() - 1, tip(self._link.resolve(topic)), Qt.ItemDataRole.ToolTipRole)

    def _offer_simulators_camera(self, state: LinkState) -> None:
        """Offer robot_camera, once a simulator publishes it beside the camera's own pictures."""
        choice, topic = self._window.cameraChoice, self.robot.robot_camera
        if not state.robot_camera or self.robot.by_movement or choice.findData(topic) >= 0:
            return
        if not choice.count():
            self._offer_camera("Camera", self._link.feed)
        self._offer_camera("robot_camera", topic)
        choice.show()
        self._window.feedLabel.hide()

    def _change_camera(self, topic: str) -> None:
        """Show another of the robot's cameras."""
        self._lens = None
        self._begin_feed()
        self.floor_drive.release_all()
        self._link.change_topic("picture", topic)
        self._link.change_topic("lens", self.robot.lens_of(topic))
        self._window.video.clear("Waiting for the first picture", self._link.feed)
        self._window.pad.setFocus()

    def _begin_feed(self) -> None:
        self._picture_age.begin()
        self._other_clock = False

    def _on_picture(self, picture: Picture) -> None:
        now = time.monotonic()
        age = self._picture_age.of(picture.stamp, time.time(), now)
        self._delay_limit.note_picture(age, now)
        self._window.health.show_picture(age, self._window.video.rate())
        differs = self._picture_age.clocks_differ(now)
        if differs and not self._other_clock:
            self.said.emit(OTHER_CLOCK, "warn")
        self._other_clock = differs

    def _look_for_camera(self) -> None:
        """Do not wait for pictures of a program whose connection has closed: it was killed."""
        before, self._cameras = self._cameras, self._link.publishers("picture")
        if before and not self._cameras:
            self._window.video.lose_source()

    def _on_stale(self, stale: bool) -> None:
        """Show the age of the last picture as it grows."""
        if stale:
            self._age_timer.start()
        else:
            self._age_timer.stop()

    def _show_age(self) -> None:
        self._window.health.show_picture(self._window.video.age(), 0.0)

    def _watch_tablet(self) -> None:
        self._link.watch("tablet", self._window.deck.currentWidget() is self._window.tabletPage)

    def _show_page(self, state: PageState) -> None:
        """Show the state of the tablet's page where there is no picture of it: a real tablet publishes none."""
        if self._window.tablet.image is None:
            text = f"{state.text[:1].upper()}{state.text[1:]}. The page: {state.page}"
            self._window.tablet.clear("The tablet publishes no picture of its screen", text)

    def _show_tablet(self, picture: Picture) -> None:
        try:
            self._window.tablet.show_picture(picture)
        except ValueError as error:
            self._window.tablet.clear("The tablet cannot be shown", f"{error}.")

    def _on_lens(self, lens: Lens) -> None:
        self._lens = lens

    def _view(self) -> CameraView | str:
        """Return the camera's view, in the odometry frame, when the shown picture was taken; or why it is unknown."""
        image = self._window.video.image
        if image is None:
            return NO_PICTURE
        view = camera_view(self._lens, self._body, self._link.place_of, self._window.video.stamp)
        return view if isinstance(view, str) else scaled_to(view, image.width(), image.height())

    def paint_more(self, paint: Callable[[QPainter, float, float], None]) -> None:
        """Paint something else on the picture, too: `paint(painter, width, height)` [px], from its corner on."""
        self._more = paint

    @property
    def lens(self) -> Lens | None:
        """The calibration of the camera that is shown."""
        return self._lens

    def _paint_over(self, painter: QPainter, to_widget: PixelToWidget) -> None:
        self._paint_path(painter, to_widget)
        image = self._window.video.image
        if self._more is not None and image is not None:
            corner, end = to_widget(0.0, 0.0), to_widget(image.width(), image.height())
            painter.save()
            painter.translate(corner)
            self._more(painter, end.x() - corner.x(), end.y() - corner.y())
            painter.restore()

    def _paint_path(self, painter: QPainter, to_widget: PixelToWidget) -> None:
        target = self.floor_drive.target
        if target is None or self._body is None:
            return
        view = self._view()
        if isinstance(view, CameraView):
            radius = self.robot.outline.outer_radius
            start = (self._body.x, self._body.y)
            paint_path(painter, to_widget, view, start, target, radius, self.floor_drive.tone())
