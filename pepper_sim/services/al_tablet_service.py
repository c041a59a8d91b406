"""ALTabletService: the tablet on the chest.

Pages, pictures, videos and questions are shown by `pepper_sim.tablet.tablet.Tablet`. What Android adds (Wi-Fi,
keyboards) answers like a tablet in a network without a password. Addresses on the robot, http://198.18.0.1/apps/NAME/
and what follows, are the files in the folder `html` of that application. Source: NAOqi 2.8 documentation,
ALTabletService; signatures from a robot's metaobject.
"""

from __future__ import annotations

import concurrent.futures
import logging
import re
from pathlib import Path
from typing import Any

from pepper_sim.disk import APPS, RobotDisk
from pepper_sim.naoqi.service import NAOQI_VERSION, Service, one_of, remote, within
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.tablet.http_fetch import ROBOT_HOST
from pepper_sim.tablet.tablet import Tablet
from telepresence.naoqi.signals import Signal

log = logging.getLogger(__name__)

_DEFAULT_SCALE = 1.34
_OTHER_VIEWS_SCALE = 1.0
_NO_MAC_ADDRESS = "02:00:00:00:00:00"
"""What Android returns to programs without permission."""
_WIFI_SECURITY = ("open", "wep", "wpa")


class ALTabletService(Service):
    """Shows pages and pictures on the tablet."""

    name = "ALTabletService"

    def __init__(self, tablet: Tablet, disk: RobotDisk, alarm: Alarm) -> None:
        self._tablet, self._disk, self._alarm = tablet, disk, alarm
        self._scale = _DEFAULT_SCALE
        self._brightness = 1.0
        self._wifi = True
        self.onTouch = Signal("(ff)")
        self.onTouchDown = Signal("(ff)")
        self.onTouchDownRatio = Signal("(ffs)")
        self.onTouchMove = Signal("(ff)")
        self.onTouchUp = Signal("(ff)")
        self.onJSEvent = Signal("(s)")
        self.onConsoleMessage = Signal("(s)")
        self.onPageStarted = Signal("()")
        self.onPageFinished = Signal("()")
        self.onLoadPageError = Signal("(iss)")
        self.onImageLoaded = Signal("()")
        self.onInputText = Signal("(is)")
        self.onWifiStatusChange = Signal("(s)")
        self.videoStarted = Signal("()")
        self.videoFinished = Signal("()")
        tablet.on_page_started = lambda: self.onPageStarted()
        tablet.on_page_finished = lambda: self.onPageFinished()
        tablet.on_load_error = lambda code, text, url: self.onLoadPageError(code, text, url)
        tablet.on_image_loaded = lambda: self.onImageLoaded()
        tablet.on_video_started = lambda: self.videoStarted()
        tablet.on_video_finished = lambda: self.videoFinished()
        tablet.on_js_event = lambda text: self.onJSEvent(text)
        tablet.on_console = lambda text: self.onConsoleMessage(text)
        tablet.on_answer = lambda confirmed, text: self.onInputText(int(confirmed), text)
        tablet.robot_files = self._file

    def close(self) -> None:
        tablet = self._tablet
        tablet.on_page_started = tablet.on_page_finished = tablet.on_image_loaded = lambda: None
        tablet.on_video_started = tablet.on_video_finished = lambda: None
        tablet.on_load_error = lambda *_: None
        tablet.on_answer = lambda *_: None
        tablet.on_js_event = tablet.on_console = lambda *_: None
        tablet.robot_files = lambda _: None

    # --- web view ----------------------------------------------------------------------------------------------------

    @remote("b(s)")
    def loadUrl(self, url: str) -> bool:
        """Loads a page into the web view, shown or not; false if the address is not http or https."""
        return bool(self._tablet.load_url(url))

    @remote("b()", "b(s)")
    def showWebview(self, url: str = "") -> bool:
        """Shows the web view, after loading `url` if one is given."""
        if url and not self._tablet.load_url(url):
            return False
        self._tablet.show_webview()
        return True

    @remote("b()")
    def hideWebview(self) -> bool:
        """Hides the web view; the page stays loaded."""
        self._tablet.hide_webview()
        return True

    @remote("b()")
    def cleanWebview(self) -> bool:
        """Hides the web view; the next showWebview shows what is loaded then."""
        self._tablet.hide_webview()
        return True

    @remote("v(b)")
    def reloadPage(self, bypassCache: bool) -> None:
        """Loads the page again."""
        self._tablet.reload(bypassCache)

    @remote("v(s)")
    def executeJS(self, script: str) -> None:
        """Runs a script in the page. Ignored with a warning where the web view runs none, or has no page."""
        if not self._tablet.execute(script):
            log.warning("executeJS is ignored: there is no page that runs scripts")

    @remote("b(s)")
    def loadApplication(self, name: str) -> bool:
        """Loads the page of an application on the robot, http://198.18.0.1/apps/NAME/; false if it has none."""
        address = f"/apps/{name}/"
        return self._file(address) is not None and self._tablet.load_url(f"http://{ROBOT_HOST}{address}")

    @remote("f()")
    def getOnTouchScaleFactor(self) -> float:
        """Returns the scale of the view on the screen: 1 unless it is the web view."""
        return self._scale if self._tablet.visible else _OTHER_VIEWS_SCALE

    @remote("v(f)")
    def setOnTouchWebviewScaleFactor(self, scale: float) -> None:
        """Sets the web view's scale. Stored only."""
        self._scale = within(scale, 0.1, 10.0, "scale")

    # --- pictures ----------------------------------------------------------------------------------------------------

    @remote("b(s)")
    def showImage(self, url: str) -> bool:
        """Shows a picture over everything else; false if the address is not http or https."""
        return bool(self._tablet.show_image(url))

    @remote("b(s)")
    def showImageNoCache(self, url: str) -> bool:
        """Shows a picture without using the cache. There is none."""
        return bool(self._tablet.show_image(url))

    @remote("b(s)")
    def preLoadImage(self, url: str) -> bool:
        """Fetches a picture for later. There is no cache: only checks the address."""
        return url.startswith(("http://", "https://"))

    @remote("v()")
    def hideImage(self) -> None:
        """Hides the picture."""
        self._tablet.hide_image()

    @remote("v()")
    def pauseGif(self) -> None:
        """Pauses an animated picture."""
        self._tablet.pause_image(True)

    @remote("v()")
    def resumeGif(self) -> None:
        """Resumes an animated picture."""
        self._tablet.pause_image(False)

    @remote("v()")
    def hide(self) -> None:
        """Hides the video, the picture and the web view."""
        self._tablet.stop_video()
        self._tablet.hide_image()
        self._tablet.hide_webview()

    @remote("b(s)")
    def setBackgroundColor(self, color: str) -> bool:
        """Sets the colour behind pictures, "#RRGGBB"; false for any other text."""
        if not re.fullmatch(r"#[0-9A-Fa-f]{6}", color):
            return False
        self._tablet.set_background(color)
        return True

    # --- video -------------------------------------------------------------------------------------------------------

    @remote("b(s)")
    def playVideo(self, url: str) -> bool:
        """Plays a video over everything else, without sound; false if the address is not http or https."""
        return bool(self._tablet.show_video(url))

    @remote("b()")
    def pauseVideo(self) -> bool:
        """Pauses the video; false if none plays."""
        return bool(self._tablet.pause_video(True))

    @remote("b()")
    def resumeVideo(self) -> bool:
        """Resumes the video; false if none plays."""
        return bool(self._tablet.pause_video(False))

    @remote("b()")
    def stopVideo(self) -> bool:
        """Stops the video; false if none plays."""
        return bool(self._tablet.stop_video())

    @remote("i()")
    def getVideoLength(self) -> int:
        """Returns the video's length [ms]; -1 if none plays."""
        return int(self._tablet.video_length)

    @remote("i()")
    def getVideoPosition(self) -> int:
        """Returns the position in the video [ms]; -1 if none plays."""
        return int(self._tablet.video_position)

    # --- dialogs: a person may answer --------------------------------------------------------------------------------

    @remote("v(ssss)", "v(ssssi)", "v(sssssi)")
    def showInputDialog(self, type: str, title: str, ok: str, cancel: str, value: Any = "", limit: Any = 0) -> None:
        """Prompts the user for a text of a type, with a first `value`; onInputText brings the answer."""
        self._tablet.ask(title, value if isinstance(value, str) else "", ok, cancel)

    @remote("v(sss)", "v(ssssi)")
    def showInputTextDialog(self, title: str, ok: str, cancel: str, value: str = "", limit: int = 0) -> None:
        """Prompts the user for text, with a first `value`; onInputText brings the answer."""
        self._tablet.ask(title, value, ok, cancel)

    @remote("v()")
    def hideDialog(self) -> None:
        """Closes the dialog."""
        self._tablet.hide_dialog()

    @remote("v(fsi)")
    def showAlertView(self, opacity: float, color: str, delay: int) -> None:
        """Covers the screen with a colour, 0 to 1 opaque, for a time [ms]."""
        within(opacity, 0.0, 1.0, "opacity")
        within(delay, 0, 3_600_000, "delay")
        self._tablet.cover(color, opacity)
        self._alarm.after(delay / 1000.0).add_done_callback(self._uncover)

    def _uncover(self, _: concurrent.futures.Future) -> None:
        self._tablet.uncover()

    # --- network -----------------------------------------------------------------------------------------------------

    @remote("s()")
    def getWifiStatus(self) -> str:
        """Returns IDLE, SCANNING, DISCONNECTED or CONNECTED."""
        return "CONNECTED" if self._wifi else "DISCONNECTED"

    @remote("v()")
    def enableWifi(self) -> None:
        """Switches the tablet's Wi-Fi on."""
        self._set_wifi(True)

    @remote("v()")
    def disableWifi(self) -> None:
        """Switches the tablet's Wi-Fi off. Pages still load, over this machine's own network."""
        self._set_wifi(False)

    @remote("b(s)")
    def connectWifi(self, ssid: str) -> bool:
        """Joins a network; true."""
        self._set_wifi(True)
        return True

    @remote("b()")
    def disconnectWifi(self) -> bool:
        """Leaves the network; true."""
        self._set_wifi(False)
        return True

    @remote("b(sss)")
    def configureWifi(self, security: str, ssid: str, key: str) -> bool:
        """Configures a network; security is "open", "wep" or "wpa". The key is not stored."""
        one_of(security, _WIFI_SECURITY, "security")
        return True

    @remote("b(s)")
    def forgetWifi(self, ssid: str) -> bool:
        """Forgets a network; none is stored: false."""
        return False

    @remote("s()")
    def getWifiMacAddress(self) -> str:
        """Returns the hardware address."""
        return _NO_MAC_ADDRESS

    @remote("s()")
    def robotIp(self) -> str:
        """Returns the robot's address as seen from the tablet."""
        return ROBOT_HOST

    # --- device ------------------------------------------------------------------------------------------------------

    @remote("f()")
    def getBrightness(self) -> float:
        """Returns the brightness, 0 to 1."""
        return self._brightness

    @remote("b(f)")
    def setBrightness(self, brightness: float) -> bool:
        """Sets the brightness, 0 to 1."""
        self._brightness = within(brightness, 0.0, 1.0, "brightness")
        self._tablet.set_brightness(self._brightness)
        return True

    @remote("v(b)")
    def turnScreenOn(self, enable: bool) -> None:
        """Switches the screen on or off; what it shows stays."""
        self._tablet.switch(enable)

    @remote("v()")
    def goToSleep(self) -> None:
        """Turns the screen off."""
        self._tablet.switch(False)

    @remote("v()")
    def wakeUp(self) -> None:
        """Turns the screen on."""
        self._tablet.switch(True)

    @remote("v()")
    def resetTablet(self) -> None:
        """Restarts Android's user interface: nothing is shown, on a screen that is on."""
        self.hide()
        self._tablet.hide_dialog()
        self._tablet.switch(True)

    @remote("b(i)")
    def setVolume(self, volume: int) -> bool:
        """Sets the tablet's own volume, 0 to 15. According to the documentation it always returns false."""
        within(volume, 0, 15, "volume")
        return False

    @remote("b(s)")
    def setTabletLanguage(self, language: str) -> bool:
        """Sets the language of Android. It shows no text of its own: true."""
        return True

    @remote("[s]()")
    def getAvailableKeyboards(self) -> list[str]:
        """Lists the keyboards."""
        return []

    @remote("b(s)")
    def setKeyboard(self, keyboardId: str) -> bool:
        """Sets the keyboard; there is none: false."""
        return False

    @remote("s()")
    def version(self) -> str:
        """Returns the service's version."""
        return NAOQI_VERSION

    def _file(self, path: str) -> Path | None:
        """Return the file behind an address on the robot's web server: /apps/NAME/FILE, or a folder's index.html."""
        parts = path.split("/", 3)
        if len(parts) < 4 or parts[1] != "apps" or not parts[2]:
            return None
        try:
            file = self._disk.path(f"{APPS}/{parts[2]}/html/{parts[3]}")
        except ValueError:
            return None
        file = file / "index.html" if file.is_dir() else file
        return file if file.is_file() else None

    def _set_wifi(self, on: bool) -> None:
        if on != self._wifi:
            self._wifi = on
            self.onWifiStatusChange(self.getWifiStatus())
