"""Hands on the page: keys, thumbs, gamepad, a place on the floor, handing over. Chromium, a ROS graph, the real
drive_lease; the robot is its topics: it moves as it is told, and its head turns."""

from __future__ import annotations

import contextlib
import math
import sys
import time

import pytest
from page_browser import FORWARD, ZERO, Browser, drives, enter, heard, hold_until, let_go_of_the_stop
from repeated_presses import press_until

pytestmark = [pytest.mark.ros, pytest.mark.browser]

HEIGHT, PITCH, HEAD = 1.1, math.radians(25), 0.5
"""The camera's height [m], how far it looks down, and how far it is turned to the left when the robot stands [rad]."""
FOCAL, WIDTH, ROWS = 130.0, 160, 120
"""[px] of the pictures that `page_browser.PICTURES` publishes."""
POSE = [f"pose.pose.{part}" for part in ("position.x", "position.y", "orientation.z", "orientation.w")]
NEAR = 0.25
"""[m] from the place that was pointed at, where the robot has to stop."""
PAUSE = 3.0
"""[s] after which the robot stands for good; late pictures of a busy machine take less."""
PATIENCE = 120.0
"""[s] until the robot has come to a place without that the page had to let go."""
SLEEP = 2.0
"""[s]"""
PANIC = 1.0
"""[s] after a stop in which no press resets it (driving.js)."""
SLOW = """
globalThis.late = 700;  // ms that all messages of the page are under way
const send = RTCDataChannel.prototype.send;
RTCDataChannel.prototype.send = function (message) { setTimeout(() => {
  if (this.readyState === "open") send.call(this, message);
}, globalThis.late); };
"""
ROBOT = f"""
import math, rospy
from geometry_msgs.msg import Twist, TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo
from tf2_msgs.msg import TFMessage

def turned(yaw, pitch=0.0):
    (cy, sy), (cp, sp) = [(math.cos(angle / 2), math.sin(angle / 2)) for angle in (yaw, pitch)]
    return -sy * sp, cy * sp, sy * cp, cy * cp

def optical(q):
    # x right, y down, z ahead: turned by (-0.5, 0.5, -0.5, 0.5) in the head
    (ax, ay, az, aw), (bx, by, bz, bw) = q, (-0.5, 0.5, -0.5, 0.5)
    return (aw*bx + ax*bw + ay*bz - az*by, aw*by - ax*bz + ay*bw + az*bx,
            aw*bz + ax*by - ay*bx + az*bw, aw*bw - ax*bx - ay*by - az*bz)

def transform(parent, child, place, q):
    message = TransformStamped()
    message.header.stamp, message.header.frame_id, message.child_frame_id = rospy.Time.now(), parent, child
    t, r = message.transform.translation, message.transform.rotation
    (t.x, t.y, t.z), (r.x, r.y, r.z, r.w) = place, q
    return message

rospy.init_node("robot")
asked, x, y, yaw, moving = Twist(), 0.0, 0.0, 0.0, 0.0
def on_twist(message):
    global asked
    asked = message
rospy.Subscriber("/cmd_vel", Twist, on_twist, queue_size=1, tcp_nodelay=True)
odometry = rospy.Publisher("/odom", Odometry, queue_size=1)
transforms = rospy.Publisher("/tf", TFMessage, queue_size=10)
lens = rospy.Publisher("/pepper_robot/camera/front/camera_info", CameraInfo, queue_size=1)
rate, step = rospy.Rate(50), 0.02
while not rospy.is_shutdown():
    v, w = asked.linear, asked.angular.z
    x += step * (v.x * math.cos(yaw) - v.y * math.sin(yaw))
    y += step * (v.x * math.sin(yaw) + v.y * math.cos(yaw))
    yaw += step * w
    moving = moving + step if v.x or v.y or w else 0.0
    head = {HEAD} + 0.6 * math.sin(2.0 * moving)  # it looks around while the robot drives
    message = Odometry()
    message.header.stamp, message.header.frame_id = rospy.Time.now(), "odom"
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    q = message.pose.pose.orientation
    q.x, q.y, q.z, q.w = turned(yaw)
    odometry.publish(message)
    transforms.publish(TFMessage([
        transform("odom", "base_link", (x, y, 0.0), turned(yaw)),
        transform("base_link", "camera", (0.0, 0.0, {HEIGHT}), optical(turned(head, {PITCH}))),
    ]))
    info = CameraInfo(width={WIDTH}, height={ROWS}, K=[{FOCAL}, 0, {WIDTH / 2}, 0, {FOCAL}, {ROWS / 2}, 0, 0, 1])
    info.header.frame_id = "camera"
    lens.publish(info)
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
"""


@pytest.fixture(scope="module")
def robot(graph, probe):
    graph.run(sys.executable, "-c", ROBOT)
    probe.watch(
        "/odom",
        "nav_msgs/Odometry",
        [f"pose.pose.{part}" for part in ("position.x", "position.y", "orientation.z", "orientation.w")],
    )
    return lambda: probe.newest("/odom")


@pytest.fixture(scope="module")
def browser(running, robot, wait_until):
    browser = Browser(running[1])
    with contextlib.closing(browser.tools):
        yield enter(browser, wait_until)
        assert browser.errors == []


@pytest.fixture
def anna(browser, probe, wait_until):
    """Her page while nothing is held."""
    yield browser
    browser.evaluate("document.dispatchEvent(new Event('visibilitychange'))")
    wait_until(lambda: not heard(probe) or heard(probe)[-1] == ZERO, "the robot stands")
    probe.forget("/cmd_vel")


def box(browser, selector):
    return browser.evaluate(
        f"(({{left, top, width, height}}) => [left, top, width, height])"
        f"(document.querySelector('{selector}').getBoundingClientRect())"
    )


def middle(browser, selector):
    left, top, width, height = box(browser, selector)
    return left + width / 2, top + height / 2


def mouse(browser, kind, x, y):
    browser.tools.call(
        "Input.dispatchMouseEvent",
        type=kind,
        x=x,
        y=y,
        button="left",
        clickCount=1,
        buttons=int(kind != "mouseReleased"),
    )


def touch(browser, kind, *points):
    fingers = [{"x": x, "y": y, "id": number} for number, (x, y) in points]
    browser.tools.call("Input.dispatchTouchEvent", type=kind, touchPoints=fingers)


def alert(browser):
    return browser.text("alert")


def logic(browser, module, script):
    """What a module without DOM says, with a clock of the test's."""
    return browser.evaluate(f"import('/static/{module}.js').then((m) => {{ {script} }})")


def test_a_slow_connection_drives_at_half_speed_or_not_at_all(anna):
    shares = logic(
        anna,
        "delay",
        """const [quick, slow, lost, old] = [0, 0, 0, 0].map(() => new m.DelayLimit());
        for (let n = 1; n <= 40; n += 1) {
          for (const limit of [quick, slow, lost]) limit.sent(n, 50 * n);
          quick.answered(n, 50 * n + 40);
          if (n > 14) slow.answered(n - 14, 50 * n);
          old.note("picture", 600, 50 * n);
        }
        const shares = [quick, slow, lost, old].map((limit) => limit.share(2000));
        lost.answered(40, 2700);
        shares.push(lost.share(2710), quick.share(2600));
        lost.sent(41, 2750);
        lost.answered(41, 2790);
        return [...shares, lost.share(2800)];""",
    )
    assert shares == [1, 0.5, 0, 0.5, 0.5, 1, 1], "after being lost half until a command is answered in time"


def test_the_next_picture_may_take_two_and_a_half_periods(anna):
    late = logic(
        anna,
        "delay",
        """const [often, rare] = [new m.Patience(), new m.Patience()];
        for (let n = 0; n < 9; n += 1) { often.note(50 * n); rare.note(200 * n); }
        return [often.late(690), often.late(710), rare.late(2090), rare.late(2110)];""",
    )
    assert late == [False, True, False, True]


def test_a_gamepad_has_to_be_let_go_and_pressed_again_when_it_was_held_or_stuck(anna):
    parts, cross = logic(
        anna,
        "gamepad",
        """const pad = (down, out) => ({ axes: [0, -out, 0, 0],
          buttons: [...Array(16).keys()].map((n) => ({ pressed: down.includes(n) })) });
        const hand = new m.PadHand();
        const parts = [[[4], 1, 0], [[], 1, 50], [[4], 1, 100], [[4], 0.9, 2050], [[4], 0.9, 4000], [[4], 0.9, 4100],
          [[4], 0.8, 4200], [[], 0, 4250], [[4], 0.8, 4300]]
          .map(([down, out, now]) => Math.sign(hand.read(pad(down, out), now).parts?.[0] ?? 0));
        hand.read(pad([], 0), 5000);
        return [parts, hand.read(pad([4, 12], 0), 5100).parts];""",
    )
    assert parts == [0, 0, 1, 1, 1, 0, 0, 0, 1] and cross == [0.25, 0, 0]


def test_what_is_held_together_is_no_faster_than_the_robot(anna):
    across, speed, boosted = logic(
        anna,
        "held",
        """const held = new m.Held();
        held.hold("w", [1, 0, 0]);
        held.hold("a", [0, 1, 0]);
        const across = held.velocity();
        held.setSpeed(0.5);
        held.release("a");
        held.boost = 2;
        return [across, held.speed, held.velocity()];""",
    )
    assert across == pytest.approx([0.2 / math.sqrt(2)] * 2 + [0]) and (speed, boosted) == (0.35, [0.35, 0, 0])


def test_keys_drive_as_in_the_window_at_the_speed_that_was_chosen(anna, probe, wait_until):
    drives(probe, wait_until, anna)
    anna.key("PageDown", True)
    hold_until(anna, wait_until, lambda: heard(probe)[-1] == pytest.approx([0.15, 0.0, 0.0]), "it is slower")
    anna.key("KeyW", False)
    for key, velocity in (("KeyA", [0.0, 0.15, 0.0]), ("KeyE", [0.0, 0.0, -0.375]), ("ArrowLeft", [0.0, 0.0, 0.375])):
        hold_until(anna, wait_until, lambda v=velocity: heard(probe)[-1] == pytest.approx(v), key, key)
        anna.key(key, False)
    anna.key("PageUp", True)
    wait_until(lambda: anna.evaluate("document.getElementById('speed').value") == "0.2", "the slider shows it")


def test_whoever_writes_does_not_drive(anna, probe, wait_until):
    drives(probe, wait_until, anna)
    anna.evaluate("document.body.append(Object.assign(document.createElement('input'), {id: 'words'})); words.focus()")
    wait_until(lambda: heard(probe)[-1] == ZERO, "the focus in a text stops")
    probe.forget("/cmd_vel")
    anna.key("KeyW", True)
    anna.key("Space", True)
    anna.evaluate("new Promise((done) => setTimeout(done, 200))")  # of writing
    anna.evaluate("words.remove()")
    anna.key("KeyW", False)
    assert FORWARD not in heard(probe) and anna.evaluate("document.getElementById('stop').textContent") == "Stop"


@pytest.mark.parametrize("hand", ["finger", "mouse"])
def test_an_arrow_drives_for_as_long_as_it_is_held(anna, probe, wait_until, hand):
    """Pressed in its middle, where the icon is."""
    x, y = middle(anna, "[data-drive=forward]")

    def press():
        touch(anna, "touchStart", (1, (x, y))) if hand == "finger" else mouse(anna, "mousePressed", x, y)

    def release():
        touch(anna, "touchEnd") if hand == "finger" else mouse(anna, "mouseReleased", x, y)

    probe.forget("/cmd_vel")
    press_until(press, release, wait_until, lambda: heard(probe)[-3:] == [FORWARD] * 3, "the arrow drives")
    release()
    wait_until(lambda: heard(probe)[-1] == ZERO, "letting go stops")


def test_two_thumbs_a_sliding_one_is_a_stick_the_other_stops(anna, probe, wait_until):
    x, y = middle(anna, "[data-drive=forward]")
    press, release = lambda: touch(anna, "touchStart", (1, (x, y))), lambda: touch(anna, "touchEnd")

    def slide():
        release()
        press()
        touch(anna, "touchMove", (1, (x - 40, y - 40)))

    press_until(press, release, wait_until, lambda: FORWARD in heard(probe), "the button drives")
    ahead_and_left = lambda: heard(probe)[-1][0] > 0.05 and heard(probe)[-1][2] > 0.1  # noqa: E731
    press_until(slide, lambda: None, wait_until, ahead_and_left, "forward and to the left")
    assert heard(probe)[-1][0] < 0.2 and heard(probe)[-1][1] == 0.0
    assert anna.evaluate("document.querySelectorAll('.pad button.held').length") == 0
    other = middle(anna, "#stop")
    touch(anna, "touchStart", (1, (x - 40, y - 40)), (2, other))
    wait_until(lambda: "red stop" in anna.text("status"), "the other thumb stops")
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot stands")
    probe.forget("/cmd_vel")
    let_go_of_the_stop(anna, wait_until)
    touch(anna, "touchMove", (1, (x, y - 40)), (2, other))
    anna.evaluate("new Promise((done) => setTimeout(done, 200))")  # of sliding on
    touch(anna, "touchEnd")
    assert not [fields for fields in heard(probe) if any(fields)]


def test_the_right_thumb_goes_sideways_where_there_is_no_head_to_turn(anna, probe, wait_until):
    anna.tools.call("Emulation.setTouchEmulationEnabled", enabled=True)
    x, y = middle(anna, "#sidePad")

    def press():
        touch(anna, "touchStart", (1, (x, y)))
        touch(anna, "touchMove", (1, (x + 60, y)))

    right = lambda: heard(probe) and heard(probe)[-1] == pytest.approx([0.0, -0.2, 0.0])  # noqa: E731
    press_until(press, lambda: touch(anna, "touchEnd"), wait_until, right, "it goes to the right")
    touch(anna, "touchEnd")
    wait_until(lambda: heard(probe)[-1] == ZERO, "letting go stops")
    anna.tools.call("Emulation.setTouchEmulationEnabled", enabled=False)


def test_a_gamepad_drives_while_lb_is_held_and_stands_when_it_is_unplugged(anna, probe, wait_until):
    anna.evaluate(
        "globalThis.pad = {connected: true, index: 0, id: 'pad', mapping: 'standard', axes: [0, 0, 0, 0],"
        " buttons: [...Array(17)].map(() => ({pressed: false, value: 0}))};"
        "navigator.getGamepads = () => [globalThis.pad]"
    )
    wait_until(lambda: "LB" in anna.text("padChip"), "it is there")
    anna.evaluate("pad.axes[1] = -1")
    anna.evaluate("new Promise((done) => setTimeout(done, 200))")  # of moving a stick alone
    assert not [fields for fields in heard(probe) if any(fields)]

    def press():
        anna.evaluate("pad.buttons[4] = {pressed: true, value: 1}")

    def release():  # for as long as the page needs to see it
        anna.evaluate("pad.buttons[4] = {pressed: false, value: 0}; new Promise((done) => setTimeout(done, 300))")

    press_until(press, release, wait_until, lambda: FORWARD in heard(probe), "with LB it drives")
    anna.evaluate("pad.buttons[5] = {pressed: true, value: 1}")
    fast = lambda: heard(probe)[-1] == pytest.approx([0.35, 0.0, 0.0])  # noqa: E731
    press_until(press, release, wait_until, fast, "with RB as fast as the gate allows")
    anna.evaluate("navigator.getGamepads = () => []")  # a browser's list, which it looks at, may be ahead of its event
    wait_until(lambda: heard(probe)[-1] == ZERO, "without it the robot stands")
    wait_until(lambda: "unplugged" in alert(anna), "the page says why")


def test_leaving_the_full_screen_while_driving_is_the_red_stop(anna, probe, wait_until):
    """Esc leaves it before any page hears of the key."""
    drives(probe, wait_until, anna)
    anna.evaluate("document.dispatchEvent(new Event('fullscreenchange'))")
    wait_until(lambda: "red stop" in anna.text("status"), "it is stopped")
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot stands")
    anna.key("KeyW", False)
    let_go_of_the_stop(anna, wait_until)


def test_a_long_press_of_the_red_stop_is_one_press(anna, probe, wait_until):
    """Its click comes with the release, when the page may reset the stop: that takes another press."""
    drives(probe, wait_until, anna)
    mouse(anna, "mousePressed", *middle(anna, "#stop"))
    wait_until(lambda: "red stop" in anna.text("status"), "it is stopped")
    anna.key("KeyW", False)
    anna.evaluate(f"new Promise((done) => setTimeout(done, {1000 * PANIC + 200}))")
    mouse(anna, "mouseReleased", *middle(anna, "#stop"))
    anna.evaluate("new Promise((done) => setTimeout(done, 500))")  # as long as a request takes
    assert "red stop" in anna.text("status")
    let_go_of_the_stop(anna, wait_until)


def test_space_stops_who_drives_wherever_the_focus_is(anna, probe, wait_until):
    anna.evaluate(
        "globalThis.box = document.body.appendChild(document.createElement('input'));box.type = 'checkbox'; box.focus()"
    )
    drives(probe, wait_until, anna)
    anna.key("Space", True)
    wait_until(lambda: "red stop" in anna.text("status"), "it is stopped")
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot stands")
    for code in ("Space", "KeyW"):
        anna.key(code, False)
    anna.evaluate("box.remove()")
    let_go_of_the_stop(anna, wait_until)


def floor_at(u, v):
    """Where on the floor the standing robot's picture shows this share of it [m]."""
    right, down = (u - 0.5) * WIDTH / FOCAL, (v - 0.5) * ROWS / FOCAL
    slope = math.sin(PITCH) + down * math.cos(PITCH)
    ahead = HEIGHT / slope * (math.cos(PITCH) - down * math.sin(PITCH))
    left = -HEIGHT / slope * right
    return ahead * math.cos(HEAD) - left * math.sin(HEAD), ahead * math.sin(HEAD) + left * math.cos(HEAD)


def shown_at(ahead, left):
    """Where the standing robot's picture shows a place on the floor [m]; None where it does not."""
    forward, beside = ahead * math.cos(HEAD) + left * math.sin(HEAD), left * math.cos(HEAD) - ahead * math.sin(HEAD)
    depth = forward * math.cos(PITCH) + HEIGHT * math.sin(PITCH)
    down = HEIGHT * math.cos(PITCH) - forward * math.sin(PITCH)
    u, v = 0.5 - beside / depth * FOCAL / WIDTH, 0.5 + down / depth * FOCAL / ROWS
    return (u, v) if depth > 0 and 0.02 < u < 0.98 and 0.02 < v < 0.98 else None


@pytest.mark.parametrize("at", [(0.6, 0.75), (0.2, 0.55)])
def test_a_place_held_in_the_picture_is_driven_to_while_the_head_turns(anna, robot, probe, wait_until, at):
    """A page that got no processor for half a second lets go, as it must: the place is held again where it is now."""
    assert shown_at(*floor_at(*at)) == pytest.approx(at)
    anna.evaluate(
        "globalThis.said = []; new MutationObserver(() => said.push(document.getElementById('alert').textContent))"
        ".observe(document.getElementById('alert'), { childList: true, characterData: true, subtree: true })"
    )
    place, deadline = None, time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        x, y, sine, cosine = robot()
        yaw = 2 * math.atan2(sine, cosine)
        seen = place and shown_at(*turned(place[0] - x, place[1] - y, -yaw))
        if not seen:
            seen, (dx, dy) = at, turned(*floor_at(*at), yaw)
            place = x + dx, y + dy
        interrupted = hold(anna, probe, wait_until, seen)
        if not interrupted:
            break
    assert math.dist(place, robot()[:2]) <= NEAR, interrupted


def turned(x, y, angle):
    return x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)


def hold(browser, probe, wait_until, at):
    """Hold a place in the picture until the robot stands. Return what the page said meanwhile."""
    edge, top, width, height = box(browser, "#picture")
    finger = edge + at[0] * width, top + at[1] * height
    browser.evaluate("said.length = 0")
    probe.forget("/cmd_vel")
    mouse(browser, "mousePressed", *finger)
    moved = lambda: any(any(fields) for fields in heard(probe))  # noqa: E731
    wait_until(lambda: moved() or browser.evaluate("said.length"), "it drives")
    wait_until(lambda: not moved() or time.time() - last_move(probe) > PAUSE, "it stands")
    mouse(browser, "mouseReleased", *finger)
    return browser.evaluate("said.filter(Boolean)")


def last_move(probe):
    return max(when for when, fields in probe.seen("/cmd_vel") if any(fields))


def test_letting_go_of_the_floor_stops_and_a_short_click_only_explains(anna, probe, wait_until):
    edge, top, width, height = box(anna, "#picture")
    finger = edge + 0.5 * width, top + 0.5 * height
    press, release = lambda: mouse(anna, "mousePressed", *finger), lambda: mouse(anna, "mouseReleased", *finger)
    press_until(press, release, wait_until, lambda: any(any(fields) for fields in heard(probe)), "it drives")
    release()
    wait_until(lambda: heard(probe)[-1] == ZERO, "letting go stops")
    probe.forget("/cmd_vel")
    mouse(anna, "mousePressed", *finger)
    mouse(anna, "mouseReleased", *finger)
    wait_until(lambda: "Hold" in alert(anna), "a click says what to do")
    assert not [fields for fields in heard(probe) if any(fields)]
    mouse(anna, "mousePressed", edge + 0.5 * width, top + 0.01 * height)
    wait_until(lambda: "no floor" in alert(anna) or any(any(fields) for fields in heard(probe)), "or why not")
    mouse(anna, "mouseReleased", edge + 0.5 * width, top + 0.01 * height)


def test_a_thumb_that_slides_takes_over_from_a_held_place_and_its_release_stops(anna, probe, wait_until):
    anna.tools.call("Emulation.setTouchEmulationEnabled", enabled=True)
    edge, top, width, height = box(anna, "#picture")
    place, (x, y) = (edge + 0.5 * width, top + 0.6 * height), middle(anna, "#sidePad")

    def release():
        touch(anna, "touchEnd")
        wait_until(lambda: not any(any(fields) for fields in heard(probe)[-3:]), "nothing is held any more")

    def slide():
        probe.forget("/cmd_vel")
        touch(anna, "touchStart", (1, place))
        wait_until(lambda: any(any(fields) for fields in heard(probe)), "it is held")
        touch(anna, "touchStart", (1, place), (2, (x, y)))
        for right in (20, 40, 60):
            touch(anna, "touchMove", (1, place), (2, (x + right, y)))

    right = lambda: heard(probe) and heard(probe)[-1] == pytest.approx([0.0, -0.2, 0.0])  # noqa: E731
    press_until(slide, release, wait_until, right, "the thumb drives")
    release()
    anna.tools.call("Emulation.setTouchEmulationEnabled", enabled=False)


def test_a_place_takes_over_from_a_key_and_its_release_stops(anna, probe, wait_until):
    edge, top, width, height = box(anna, "#picture")
    finger = edge + 0.5 * width, top + 0.6 * height

    def press():
        drives(probe, wait_until, anna)
        mouse(anna, "mousePressed", *finger)

    def release():
        mouse(anna, "mouseReleased", *finger)

    there = lambda: any(any(fields) and fields != FORWARD for fields in heard(probe))  # noqa: E731
    press_until(press, release, wait_until, there, "it drives to the place")
    release()
    wait_until(lambda: heard(probe)[-1] == ZERO, "letting go of the place stops, whatever the key does")
    anna.key("KeyW", False)
    probe.forget("/cmd_vel")
    mouse(anna, "mousePressed", *finger)
    mouse(anna, "mouseReleased", *finger)
    wait_until(lambda: "Hold" in alert(anna), "the next press is a press like any other")
    assert not [fields for fields in heard(probe) if any(fields)]


def test_a_place_that_is_let_go_of_before_it_counts_as_held_is_told_of(anna, robot, wait_until):
    """A page that got no processor for a while holds nothing afterwards, although the finger is still down."""
    edge, top, width, height = box(anna, "#picture")
    finger = edge + 0.5 * width, top + 0.75 * height
    anna.evaluate("document.getElementById('alert').textContent = ''")

    def press():
        mouse(anna, "mousePressed", *finger)
        anna.evaluate("{ const woken = performance.now() + 700; while (performance.now() < woken); }")

    release = lambda: mouse(anna, "mouseReleased", *finger)  # noqa: E731
    press_until(press, release, wait_until, lambda: "asleep" in alert(anna), "the page says why the robot stands")
    release()


def test_a_page_drives_after_a_sleep_that_its_clock_has_missed(anna, probe, wait_until):
    """performance.now() stands still while a computer sleeps, in most browsers; what is sent afterwards is not late."""
    drives(probe, wait_until, anna)
    anna.evaluate(f"""{{
      const counts = performance.now.bind(performance), woken = counts() + {1000 * SLEEP};
      while (counts() < woken);
      performance.now = () => counts() - {1000 * SLEEP};
    }}""")
    wait_until(lambda: heard(probe)[-1] == ZERO, "what was held before holds no more")
    drives(probe, wait_until, anna)
    anna.evaluate("delete performance.now")
    drives(probe, wait_until, anna)
    anna.key("KeyW", False)


def test_the_robot_is_handed_over_to_a_page_with_a_slow_connection(anna, open_page, probe, wait_until):
    ben = open_page(SLOW)
    wait_until(lambda: ben.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is")
    ben.sign_in("ben")
    hidden = lambda browser, part: browser.evaluate(f"document.getElementById('{part}').hidden")  # noqa: E731
    press = lambda browser, part: browser.evaluate(f"document.getElementById('{part}').click()")  # noqa: E731
    wait_until(lambda: ben.text("take") == "Ask to drive" and ben.width(), "ben sees, and that somebody drives")
    wait_until(lambda: "anna drives" in ben.text("status"), "and who that is")
    hold_until(ben, wait_until, lambda: "anna drives" in alert(ben), "he is told why nothing drives")

    def asks() -> None:
        """A page that is held up may dial again, and what it has asked for is forgotten."""
        press_until(
            lambda: press(ben, "take"),
            lambda: None,
            wait_until,
            lambda: not hidden(anna, "keep") and "ben asks" in alert(anna),
            "anna is asked",
        )

    def is_told_of_a_refusal() -> bool:
        asks()
        press(anna, "keep")
        wait_until(lambda: hidden(anna, "keep"), "she keeps it")
        end = time.monotonic() + 8.0
        while "anna keeps the robot" not in alert(ben) and time.monotonic() < end:
            time.sleep(0.1)
        return "anna keeps the robot" in alert(ben)

    assert any(is_told_of_a_refusal() for _ in range(4))
    asks()
    assert anna.text("give") == "Hand over to ben"
    press(anna, "give")
    wait_until(lambda: hidden(ben, "take") and not hidden(anna, "take"), "ben has it")
    assert not [fields for fields in heard(probe) if any(fields)], "what he held before drives nothing"
    slowly = [0.1, 0.0, 0.0]
    hold_until(ben, wait_until, lambda: slowly in heard(probe), "by a slow connection he drives at half speed")
    ben.evaluate("globalThis.late = 0")
    hold_until(ben, wait_until, lambda: heard(probe)[-1] == FORWARD, "by a quick one at full speed")
    ben.evaluate("globalThis.late = 1500")
    hold_until(
        ben, wait_until, lambda: "more than a second late" in alert(ben), "by one that is too slow he is told so"
    )
    wait_until(lambda: heard(probe)[-1] == ZERO, "and drives nothing")
    ben.key("KeyW", False)
    ben.evaluate("globalThis.late = 0")
    press(ben, "release")
    wait_until(lambda: anna.text("take") == "Take the robot", "it is free")
    assert ben.errors == []
    press(anna, "take")
    wait_until(lambda: hidden(anna, "take"), "anna has it again")
