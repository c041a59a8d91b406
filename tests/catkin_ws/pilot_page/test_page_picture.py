"""What the page paints over the picture and says of it: the gate's ring, the battery, faults, the picture's age."""

from __future__ import annotations

import sys
import time

import pytest
from page_browser import NOISE

from telepresence.page.stream_choice import PATIENCE

pytestmark = [pytest.mark.ros, pytest.mark.browser]

ROBOT = """
import rospy
from sensor_msgs.msg import BatteryState
from telepresence_msgs.msg import Fault, SafetyState
rospy.init_node("robot")
battery = rospy.Publisher("/pepper_robot/battery", BatteryState, queue_size=1, latch=True)
battery.publish(BatteryState(percentage=0.22, voltage=25.0))
faults = rospy.Publisher("/station/faults", Fault, queue_size=1)
gate = rospy.Publisher("/safety", SafetyState, queue_size=1)
allowed = [0.0] * 5 + [0.2] * 5 + [0.35] * 62
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    gate.publish(SafetyState(state="limited", reason="A chair is near.", allowed=allowed))
    faults.publish(Fault(stamp=rospy.Time.now(), program="/pepper_sonar", what="froze", next="starts again"))
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
"""
RING = """(() => { const tones = [...document.querySelectorAll("#gateRing [data-tone]")].map((one) => one.dataset.tone);
  return ["bad", "warn", "good"].map((tone) => tones.filter((one) => one === tone).length); })()"""
CLOCK = """(async () => { const { PictureAge } = await import("./static/picture_age.js");
  const clock = new PictureAge(), seen = [clock.stampOf(5), clock.age(1000, 7, 0)];
  clock.note([4294967290, 0.05, 1000], 7.25); clock.note([4294967290, 0.05, 1000], 7.15);
  const stamps = [4294967290, 89994, 4294877290].map((rtp) => clock.stampOf(rtp));
  return [...seen, ...stamps, clock.age(1000, 7.2, 0.1)]; })()"""
SHOWN = """(async () => { const { Page } = await import("./static/page.js");
  const { start } = await import("./static/status.js");
  const page = new Page(), seen = [page.pictureAge()];
  start(page);
  page.state = { picture: [90000, 0.05, 1000] };
  seen.push(page.pictureAge());
  page.emit("state");
  await new Promise((resolve) => setTimeout(resolve, 200));
  page.link.onPicture(90000);
  return [...seen, page.pictureAge()]; })()"""
WAY = """(async () => { const { arc, tones } = await import("./static/overlay.js");
  return [tones([0, 0.1, 0.35], 0.35).join(), arc(0, 72).startsWith("M"), arc(18, 72).startsWith("M-46.9")]; })()"""

KEEP_PEERS = """const Peer = RTCPeerConnection; globalThis.peers = [];
globalThis.RTCPeerConnection = class extends Peer { constructor(...words) { super(...words); peers.push(this); } };"""
RECEIVED_WIDTH = """peers.at(-1).getStats().then((reports) =>
  [...reports.values()].find((one) => one.type === "inbound-rtp" && one.kind === "video")?.frameWidth ?? 0)"""


def test_what_the_robot_says_is_painted_and_written(graph, anna, wait_until):
    graph.run(sys.executable, "-c", ROBOT)
    wait_until(lambda: anna.evaluate(RING) == [5, 5, 62], "the gate's ring is there")
    wait_until(lambda: anna.text("status") == "A chair is near.", "the gate's reason is there")
    for words in ("22 %", "The sonar's program froze; it starts again."):
        wait_until(lambda words=words: words in anna.text("facts"), words)
    age = anna.text("age")
    assert age.startswith("Picture ") and age.endswith(" ms") and anna.errors == []


def test_a_good_network_keeps_the_large_pictures(graph, anna):
    """What a browser reports of its network is the browser's own: none of it may count as a bad one."""
    graph.run(sys.executable, "-c", NOISE)
    assert anna.width() == 160
    time.sleep(PATIENCE + 2.0)  # the browser reports every second
    assert anna.width() == 160


def test_pictures_are_dated_by_one_of_them_and_the_quickest_message_and_aged_on_the_screen(anna):
    none, unknown, same, later, before, age = anna.evaluate(CLOCK)
    assert (none, unknown, same) == (None, None, 1000.0)
    assert (later, before) == (pytest.approx(1001.0), pytest.approx(999.0)), "RTP's clock wraps"
    assert age == pytest.approx(0.05 + 0.05 + 0.05), "what passed since, half of the round trip, the picture's own"
    assert anna.evaluate(WAY) == ["bad,warn,good", True, True]
    nothing, by_the_station, on_the_screen = anna.evaluate(SHOWN)
    assert nothing is None and by_the_station == 0.05, "as long as nothing else is known"
    assert on_the_screen >= 0.05 + 0.19, "it has been on its way"


def test_small_pictures_that_were_asked_for_stay_small_in_the_next_connection(open_page, wait_until):
    page = open_page(KEEP_PEERS)
    wait_until(page.asks, "the page asks who it is")
    page.sign_in("will")
    wait_until(lambda: page.evaluate(RECEIVED_WIDTH) == 160, "large pictures come")
    page.evaluate("document.querySelector('#section_picture input').click()")
    wait_until(lambda: page.evaluate(RECEIVED_WIDTH) == 80, "small ones come")
    before = page.evaluate("peers.at(-1).close(), peers.length")
    wait_until(lambda: page.evaluate("peers.length") > before, "it dials again")  # and again, on a busy machine
    wait_until(lambda: page.evaluate(RECEIVED_WIDTH) == 80, "small ones come here, too")
    assert page.errors == []
