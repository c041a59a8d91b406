"""The window's camera view alone, on a virtual screen: prints `<age> <stamp>` [s] of each picture when it is painted.

Run by the benchmark `video`: `python video_screen.py TOPIC`.
"""

from __future__ import annotations

import signal
import sys
import time

from PyQt5.QtGui import QPaintEvent
from PyQt5.QtWidgets import QApplication

from gui.robots import ROBOTS
from gui.ros.link import RosLink
from gui.ros.node import RosNode
from gui.widgets.video_view import VideoView


class TimedView(VideoView):
    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if self.image is not None:
            print(time.time() - self.stamp, self.stamp, flush=True)


def main(topic: str) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    application = QApplication(["video_screen"])
    node = RosNode()
    link = RosLink(node, ROBOTS["pepper"].with_feed(topic))
    view = TimedView()
    view.resize(960, 720)
    link.channel("picture").arrived.connect(view.show_picture)
    link.watch("picture", True)
    node.start()
    view.show()
    application.exec()


if __name__ == "__main__":
    main(sys.argv[1])
