"""Services that perceive people, over the wire, with somebody in the scene: who is there is found, nobody else."""

import math
import time

import numpy as np
import pytest

FAR = 3.4
PERSON = "PeoplePerception/Person/"


@pytest.fixture
def sitter(naoqi):
    return naoqi.simulation.world.people["person_2"]


@pytest.fixture
def subscribed(naoqi):
    """Subscribe to extractors for the length of a test."""
    services = []

    def subscribe(*names):
        for name in names:
            service = naoqi.session.service(name)
            service.subscribe("test", 100, 1.0)
            services.append(service)
        return services[-1]

    yield subscribe
    for service in services:
        service.unsubscribe("test")


@pytest.fixture
def data(naoqi):
    return lambda key: naoqi.ALMemory.getListData([key])[0]


@pytest.fixture
def events(naoqi):
    """Listen to an event: a list that grows."""
    subscribers = []

    def listen(event):
        received = []
        subscriber = naoqi.ALMemory.subscriber(event)
        subscriber.signal.connect(received.append)
        subscribers.append(subscriber)
        return received

    return listen


def one_person(data, wait_until):
    wait_until(lambda: len(data("PeoplePerception/PeopleList")) == 1, "somebody is known")
    return data("PeoplePerception/PeopleList")[0]


def test_a_person_arrives_is_described_and_leaves(naoqi, stranger, subscribed, data, events, wait_until):
    arrived, left = events("PeoplePerception/JustArrived"), events("PeoplePerception/JustLeft")
    signalled = []
    naoqi.ALPeoplePerception.justArrived.connect(signalled.append)
    subscribed("ALPeoplePerception")
    assert data("PeoplePerception/PeopleList") == []
    stranger.place(1.5, 0.4, math.pi)
    number = one_person(data, wait_until)
    wait_until(lambda: data(f"{PERSON}{number}/ShirtColor"), "the person was described")
    x, y, z = data(f"{PERSON}{number}/PositionInRobotFrame")
    assert (x, y, z) == pytest.approx((1.43, 0.4, 1.59), abs=0.05)
    camera = naoqi.ALMotion.getPosition("CameraTop", 2, True)[:3]
    assert data(f"{PERSON}{number}/Distance") == pytest.approx(math.dist(camera, (x, y, z)), abs=0.03)
    assert data(f"{PERSON}{number}/RealHeight") == pytest.approx(1.747, abs=0.01)
    assert data(f"{PERSON}{number}/ShirtColor") == "Blue" and data(f"{PERSON}{number}/IsVisible") is True
    _, people, in_torso, in_robot, camera_id = data("PeoplePerception/PeopleDetected")
    assert people[0][0] == number and len(people[0]) == 4 and len(in_torso) == len(in_robot) == 6 and camera_id == 0
    assert people[0][3] == pytest.approx(math.atan2(y - camera[1], x - camera[0]), abs=0.03), "the yaw in the image"
    naoqi.ALPeoplePerception.setTimeBeforeVisiblePersonDisappears(0.2)
    stranger.place(-2.0, 0.0)
    wait_until(lambda: left == [number], "the person left")
    assert data("PeoplePerception/PeopleList") == [] and data(f"{PERSON}{number}/Distance") is None
    wait_until(lambda: arrived == signalled == [number], "the arrival was reported")
    naoqi.ALPeoplePerception.setTimeBeforeVisiblePersonDisappears(2.0)


@pytest.mark.parametrize(
    ("x", "y", "seen"),
    [(3.0, 0.0, True), (3.9, 0.0, False), (1.0, 1.6, False), (-1.5, 0.0, False), (0.42, 0.0, False)],
    ids=["in range", "too far", "beside the picture", "behind", "too near"],
)
def test_only_who_can_be_seen_is_seen(naoqi, stranger, x, y, seen):
    stranger.place(x, y, math.pi)
    _next_tick(naoqi)
    assert bool(naoqi.simulation.server.catalogue.population.look_now().people) is seen


def _next_tick(naoqi):
    """Wait until what was placed is where it was placed, for rays too."""
    world = naoqi.simulation.world
    tick = world.tick
    while world.tick < tick + 2:
        time.sleep(0.005)


def test_nobody_is_seen_behind_somebody_else_or_through_the_robots_hand(naoqi, stranger, sitter):
    look = naoqi.simulation.server.catalogue.population.look_now
    sitter.place(2.6, 0.0, math.pi)
    _next_tick(naoqi)
    assert [seen.person.name for seen in look().people] == ["person_2"]
    stranger.place(1.2, 0.0, math.pi)
    _next_tick(naoqi)
    assert [seen.person.name for seen in look().people] == ["person_1"], "who sits behind is hidden"
    stranger.place(2.0, 0.9, math.pi)
    naoqi.ALMotion.angleInterpolation(["RShoulderPitch", "LShoulderPitch"], [-0.4, -0.4], 0.6, True)
    assert len(look().people) == 2, "the robot looks past its own arms"


def test_a_face_is_found_learned_and_recognised(naoqi, stranger, subscribed, data, wait_until):
    faces = naoqi.ALFaceDetection
    faces.clearDatabase()
    assert faces.learnFace("nobody") is False and data("FaceDetected") == []
    stranger.place(1.4, 0.0, math.pi)
    subscribed("ALFaceDetection")
    wait_until(lambda: data("FaceDetected"), "the face was found")
    stamp, content, *poses, camera = data("FaceDetected")
    (shape, extra), filtered = content[0], content[-1]
    assert abs(time.time() - stamp[0]) < 5 and len(content) == 2 and camera == 0
    assert shape[0] == 0 and shape[3] == pytest.approx(0.156 / 1.33, abs=0.02) and len(extra) == 9
    assert [len(part) for part in (*extra[3:5], *extra[7:], *poses)] == [14, 14, 6, 16, 6, 6]
    assert extra[2] == "" and filtered == []
    assert faces.learnFace("Ada") is True and faces.learnFace("Ada") is False and faces.reLearnFace("Ada") is True
    assert faces.getLearnedFacesList() == ["Ada"]
    wait_until(lambda: data("FaceDetected")[1][0][1][2] == "Ada", "the face was recognised")
    assert data("FaceDetected")[1][0][1][1] > faces.getRecognitionConfidenceThreshold()
    stranger.place(-2.0, 0.0)
    wait_until(lambda: data("FaceDetected") == [], "no face is left")
    assert faces.forgetPerson("Ada") is True and faces.forgetPerson("Ada") is False


def test_a_face_that_turns_away_is_followed_only_while_tracking_is_on(naoqi, stranger, subscribed, data, wait_until):
    faces = subscribed("ALFaceDetection")
    stranger.place(1.4, 0.0, math.pi)
    wait_until(lambda: data("FaceDetected"), "the face was found")
    stranger.watch_robots(False)
    stranger.place(1.4, 0.0, math.pi + math.radians(35.0))
    wait_until(lambda: data("FaceDetected") and abs(data("FaceDetected")[1][0][0][1]) < 0.1, "it is followed")
    faces.enableTracking(False)
    assert faces.isTrackingEnabled() is False
    wait_until(lambda: data("FaceDetected") == [], "it is lost")
    faces.enableTracking(True)
    faces.setResolution(0)
    stranger.place(1.4, 0.0, math.pi)
    wait_until(lambda: not naoqi.simulation.server.catalogue.population.last.visible or data("FaceDetected") == [], "x")
    assert data("FaceDetected") == [], "twelve pixels are too few"
    faces.setResolution(1)


def test_what_faces_and_bodies_tell(naoqi, stranger, sitter, subscribed, data, events, wait_until):
    smiling, zones = events("FaceCharacteristics/PersonSmiling"), events("EngagementZones/PersonEnteredZone1")
    moved = events("EngagementZones/PersonMovedAway")
    looking = events("GazeAnalysis/PersonStopsLookingAtRobot")
    subscribed("ALFaceCharacteristics", "ALGazeAnalysis", "ALEngagementZones", "ALSittingPeopleDetection")
    stranger.place(1.2, 0.1, math.pi)
    number = one_person(data, wait_until)
    wait_until(lambda: data("GazeAnalysis/PeopleLookingAtRobot") == [number], "the person looks here")
    wait_until(lambda: number in smiling and number in zones, "smiling and near")
    age, gender, smile = (data(f"{PERSON}{number}/{name}Properties") for name in ("Age", "Gender", "Smile"))
    assert age[0] == 30 and gender[0] == 0 and smile[0] > 0.7 and 0.3 < smile[1] <= 1.0
    assert sum(data(f"{PERSON}{number}/ExpressionProperties")) == pytest.approx(1.0)
    assert len(data(f"{PERSON}{number}/FacialPartsProperties")) == 12
    assert data(f"{PERSON}{number}/IsSitting") == 0 and data("EngagementZones/PeopleInZone1") == [number]
    assert naoqi.ALFaceCharacteristics.analyzeFaceCharacteristics(number) is True
    stranger.watch_robots(False)
    stranger.place(1.2, 0.1, math.pi + math.radians(40.0))
    wait_until(lambda: number in looking, "the person turned away")
    assert 0.0 < data(f"{PERSON}{number}/LookingAtRobotScore") < 0.5
    stranger.place(2.2, 0.1, 0.0)
    wait_until(lambda: number in moved, "the person left")
    assert data(f"{PERSON}{number}/EngagementZone") == 2
    sitter.place(1.8, -0.6, math.pi)
    wait_until(lambda: len(data("PeoplePerception/PeopleList")) == 2, "two are known")
    wait_until(lambda: data(f"{PERSON}{data('PeoplePerception/PeopleList')[1]}/IsSitting") == 1, "one of them sits")


def test_waving_is_noticed_and_only_then(naoqi, stranger, subscribed, data, events, wait_until):
    waving = events("WavingDetection/PersonWavingRight")
    subscribed("ALWavingDetection")
    stranger.place(1.5, 0.0, math.pi)
    number = one_person(data, wait_until)
    wait_until(lambda: data(f"{PERSON}{number}/IsWaving") is False, "a raised hand is no waving")
    stranger.wave(True)
    wait_until(lambda: waving == [number], "it waves")
    assert data(f"{PERSON}{number}/IsWavingRight") is True and data(f"{PERSON}{number}/IsWavingLeft") is False
    stranger.wave(False)


def test_the_tracker_turns_to_a_person_points_and_says_when_it_is_lost(naoqi, stranger, events, wait_until):
    tracker, robot = naoqi.ALTracker, naoqi.robot
    lost = events("ALTracker/TargetLost")
    tracker.initialize()
    tracker.registerTarget("People", [])
    tracker.track("People")
    assert tracker.isTargetLost() and tracker.getTargetPosition(2) == []
    stranger.place(1.5, 0.6, math.pi)
    tracker.setEffector("LArm")
    wait_until(lambda: tracker.isNewTargetDetected(), "the target is seen")
    assert tracker.getTargetPosition(2) == pytest.approx([1.43, 0.57, 1.6], abs=0.06)
    yaw = math.atan2(0.57, 1.43)
    wait_until(lambda: abs(robot.snapshot().joint_positions["HeadYaw"] - yaw) < 0.1, "the head turned")
    wait_until(lambda: angle_of_arm(robot, "l", tracker.getTargetPosition(1)) < 0.12, "the arm points")
    tracker.setEffector("None")
    tracker.setTimeOut(300)
    stranger.place(-2.0, 0.0)
    wait_until(lambda: lost == ["People"] and tracker.isTargetLost(), "it is lost")
    turned = robot.snapshot().joint_positions["HeadYaw"]
    wait_until(lambda: abs(robot.snapshot().joint_positions["HeadYaw"] - turned) > 0.1, "the head searches")
    tracker.unregisterAllTargets()
    assert not tracker.isActive() and naoqi.ALPeoplePerception.getSubscribersInfo() == []


def test_the_tracker_drives_to_its_distance(naoqi, stranger, events, wait_until):
    tracker, reached = naoqi.ALTracker, events("ALTracker/TargetReached")
    stranger.place(2.2, 0.3, math.pi)
    tracker.registerTarget("Face", 0.15)
    tracker.setMode("Move")
    tracker.setRelativePosition([-1.4, 0.0, 0.0, 0.1, 0.1, 0.3])
    tracker.track("Face")
    wait_until(lambda: reached == ["Face"], "it is there")
    x, y, *_ = naoqi.robot.truth()
    assert math.hypot(2.13 - x, 0.3 - y) == pytest.approx(1.4, abs=0.2)
    tracker.initialize()
    tracker.unregisterAllTargets()
    wait_until(lambda: not naoqi.robot.snapshot().moving, "it stands")


def test_pointing_at_a_place(naoqi, refused):
    for effector, side, position in (("RArm", "r", [1.0, -0.6, 1.3]), ("LArm", "l", [0.8, 0.5, 0.4])):
        naoqi.ALTracker.pointAt(effector, position, 2, 0.6)
        assert angle_of_arm(naoqi.robot, side, naoqi.robot.link_pose("base_footprint") @ (*position, 1.0)) < 0.1
    assert "Leg" in refused(naoqi.ALTracker.pointAt, "Leg", [1.0, 0.0, 1.0], 2, 0.5)


def angle_of_arm(robot, side, target):
    """Angle at the shoulder between the hand and a place of the odometry frame [rad]."""
    if len(target) < 3:
        return math.pi
    shoulder = robot.link_pose(f"{side.upper()}Shoulder")[:3, 3]
    hand = (robot.link_pose(f"{side}_wrist") @ (0.0695, 0.0, -0.0303, 1.0))[:3]
    a, b = np.subtract(target[:3], shoulder), hand - shoulder
    return math.acos(min(1.0, float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))))


def test_an_event_of_ones_own_is_followed(naoqi, wait_until):
    tracker = naoqi.ALTracker
    tracker.trackEvent("Test/Target")
    now = time.time()
    stamp = [int(now), int(now % 1 * 1e6)]
    naoqi.ALMemory.raiseEvent("Test/Target", [[1.0, -1.0, 1.0, 0.0, 0.0, 0.0], stamp, 0])
    wait_until(lambda: naoqi.robot.snapshot().joint_positions["HeadYaw"] < -0.6, "the head turned")
    tracker.stopTracker()


def test_awareness_tracks_a_person_and_opens_a_session(naoqi, stranger, data, events, wait_until, refused):
    awareness, users = naoqi.ALBasicAwareness, naoqi.ALUserSession
    tracked, lost, stimuli = (
        events(f"ALBasicAwareness/{event}") for event in ("HumanTracked", "HumanLost", "StimulusDetected")
    )
    awareness.setEnabled(True)
    assert awareness.isRunning() and awareness.engagePerson(1) is False and users.getFocusedUser() == -1
    stranger.place(1.5, -0.7, math.pi)
    wait_until(lambda: tracked and stimuli, "somebody is tracked")
    assert stimuli == ["People"] and tracked == data("PeoplePerception/PeopleList")
    yaw = math.atan2(-0.7, 1.43)
    wait_until(lambda: abs(naoqi.robot.snapshot().joint_positions["HeadYaw"] - yaw) < 0.1, "the head turned")
    wait_until(lambda: users.getFocusedUser() > 0, "a user was made")
    user = users.getFocusedUser()
    assert users.getOpenUserSessions() == [user] and users.getPpidFromUsid(user) == tracked[0]
    assert users.getUsidFromPpid(tracked[0]) == user and users.getCurrentEncounterDate(user)
    info = naoqi.ALUserInfo
    assert info.set("test", "likes", "tea") is True and info.get("test", user, "likes") == "tea"
    assert info.getType("test", "likes") == "string" and info.remove("test", "likes") is True
    naoqi.ALPeoplePerception.setTimeBeforeVisiblePersonDisappears(0.2)
    naoqi.ALPeoplePerception.setTimeBeforePersonDisappears(0.2)
    stranger.place(-2.0, 0.0)
    wait_until(lambda: lost and tracked[-1] == -1, "the person was lost")
    wait_until(lambda: users.getOpenUserSessions() == [] and users.getFocusedUser() == -1, "the session is closed")
    assert users.doesUserExist(user)
    wait_until(lambda: users.getSecondsSinceLastEncounter(user) >= 1, "the time since then is counted")
    awareness.setEnabled(False)
    naoqi.ALPeoplePerception.setTimeBeforeVisiblePersonDisappears(2.0)
    naoqi.ALPeoplePerception.setTimeBeforePersonDisappears(4.0)


def test_stimuli_turn_the_head_and_a_pause_does_not(naoqi, stranger):
    awareness = naoqi.ALBasicAwareness
    awareness.setEnabled(True)
    assert awareness.triggerStimulus([0.5, 1.0, 1.1]) == -1
    stranger.place(1.0, 1.6, -2.1)
    assert awareness.triggerStimulus([1.0, 1.6, 1.6]) > 0
    awareness.pauseAwareness()
    before = naoqi.robot.snapshot().joint_positions["HeadYaw"]
    stranger.place(1.6, 0.0, math.pi)
    assert not awareness.isRunning() and awareness.triggerStimulus([1.0, 0.0, 1.0]) == -1
    assert naoqi.robot.snapshot().joint_positions["HeadYaw"] == pytest.approx(before, abs=0.05)
    awareness.setEnabled(False)
    assert not awareness.isAwarenessPaused(), "switched off, it is no longer paused"


@pytest.mark.parametrize("how", ["pause", "head alone", "out of sight"])
def test_a_base_that_turns_to_somebody_stops_with_awareness(naoqi, stranger, wait_until, how):
    awareness, robot = naoqi.ALBasicAwareness, naoqi.robot
    stranger.place(1.5, 0.7, math.pi)
    awareness.setTrackingMode("BodyRotation")
    awareness.setEnabled(True)
    wait_until(lambda: robot.snapshot().moving, "the base turns")
    if how == "pause":
        awareness.pauseAwareness()
    elif how == "head alone":
        awareness.setTrackingMode("Head")
    else:
        stranger.place(-2.0, 0.0)
    wait_until(lambda: not robot.snapshot().moving, "the base stopped")
    assert robot.truth()[5] < 0.4, "before it was there"
    awareness.setTrackingMode("Head")
    awareness.setEnabled(False)


def test_a_base_that_turns_to_somebody_gives_way_to_whoever_drives(naoqi, stranger, events, wait_until):
    """Neither the turn nor its end is anything to a pilot."""
    awareness, robot, lost = naoqi.ALBasicAwareness, naoqi.robot, events("ALBasicAwareness/HumanLost")
    naoqi.ALPeoplePerception.setTimeBeforeVisiblePersonDisappears(0.2)
    stranger.place(1.5, 0.7, math.pi)
    awareness.setTrackingMode("BodyRotation")
    awareness.setEnabled(True)
    wait_until(lambda: robot.snapshot().velocity[2] > 0.1, "the base turns")
    naoqi.ALMotion.move(-0.1, 0.0, 0.0)
    wait_until(lambda: naoqi.ALMotion.getRobotVelocity() == pytest.approx([-0.1, 0.0, 0.0]), "the pilot drives")
    stranger.place(-2.0, 1.5)
    wait_until(lambda: lost, "nobody is there")
    awareness.setEnabled(False)
    assert naoqi.ALMotion.getRobotVelocity() == pytest.approx([-0.1, 0.0, 0.0])
    naoqi.ALMotion.stopMove()
    awareness.setTrackingMode("Head")
    naoqi.ALPeoplePerception.setTimeBeforeVisiblePersonDisappears(2.0)


def test_a_tracker_that_drives_gives_way_to_whoever_else_does(naoqi, stranger, events, wait_until):
    tracker, lost = naoqi.ALTracker, events("ALTracker/TargetLost")
    stranger.place(3.0, 0.0, math.pi)
    tracker.registerTarget("People", [])
    tracker.setMode("Move")
    tracker.setTimeOut(300)
    tracker.track("People")
    wait_until(lambda: naoqi.ALMotion.getRobotVelocity()[0] > 0.1, "it drives")
    naoqi.ALMotion.move(0.0, 0.0, -0.1)
    wait_until(lambda: naoqi.ALMotion.getRobotVelocity() == pytest.approx([0.0, 0.0, -0.1]), "the pilot turns")
    stranger.place(-2.0, 1.5)
    wait_until(lambda: lost == ["People"], "nobody is there")
    tracker.stopTracker()
    assert naoqi.ALMotion.getRobotVelocity() == pytest.approx([0.0, 0.0, -0.1])
    naoqi.ALMotion.stopMove()
    tracker.initialize()
    tracker.unregisterAllTargets()


@pytest.mark.parametrize(
    ("follower", "broken"),
    [
        ("tracker", "body.people_sight.PeopleSight.look"),
        ("tracker", "naoqi.people.targets.Targets.locate"),
        ("awareness", "body.people_sight.PeopleSight.look"),
        ("awareness", "naoqi.people.attention.Attention.update"),
    ],
)
def test_a_base_that_follows_somebody_stops_when_a_look_fails(
    naoqi, stranger, wait_until, monkeypatch, caplog, follower, broken
):
    tracker, awareness, robot, failures = naoqi.ALTracker, naoqi.ALBasicAwareness, naoqi.robot, []

    class Broken(Exception):
        pass

    def fail(*_, **__):
        failures.append(broken)
        raise Broken

    stranger.place(1.5, 0.7, math.pi)
    if follower == "tracker":
        tracker.registerTarget("People", [])
        tracker.setMode("Move")
        tracker.track("People")
    else:
        awareness.setTrackingMode("BodyRotation")
        awareness.setEnabled(True)
    try:
        wait_until(lambda: robot.snapshot().moving, "the base turns")
        monkeypatch.setattr(f"pepper_sim.{broken}", fail)
        wait_until(lambda: len(failures) > 2 and not robot.snapshot().moving, "it stands still")
        assert robot.truth()[5] < 0.4, "before it was there"
    finally:
        tracker.initialize()
        tracker.unregisterAllTargets()
        awareness.setEnabled(False)
        awareness.setTrackingMode("Head")
    assert [record.exc_info[0] for record in caplog.records if record.exc_info] == [Broken], "it is logged once"


NOWHERE = [[math.nan, 0.0], [math.inf, 0.0], [1e300, 0.0], ["left", 0.0]]


def test_no_event_of_a_client_keeps_awareness_from_people(naoqi, stranger, events, wait_until, caplog):
    awareness, memory, tracked = naoqi.ALBasicAwareness, naoqi.ALMemory, events("ALBasicAwareness/HumanTracked")
    awareness.setEnabled(True)
    try:
        for direction in NOWHERE:
            memory.raiseEvent("ALSoundLocalization/SoundLocated", [[0, 0], [*direction, 0.8, 0.0], [], []])
        for value in (5, None, [5], [[], [0.5]], {}):
            memory.raiseEvent("ALSoundLocalization/SoundLocated", value)
            memory.raiseEvent("TouchChanged", value)
        stranger.place(1.5, -0.7, math.pi)
        wait_until(lambda: tracked and tracked[-1] > 0, "a person is tracked all the same")
    finally:
        awareness.setEnabled(False)
        for event in ("ALSoundLocalization/SoundLocated", "TouchChanged"):
            memory.removeData(event)
    assert not [record for record in caplog.records if record.exc_info], "nothing failed"


def test_each_state_of_life_sets_awareness_anew(naoqi, stranger, wait_until):
    life, awareness, robot = naoqi.ALAutonomousLife, naoqi.ALBasicAwareness, naoqi.robot
    modes = lambda: (awareness.getEngagementMode(), awareness.getTrackingMode())  # noqa: E731
    stranger.place(1.4, 0.75, math.pi)
    awareness.setEngagementMode("SemiEngaged")
    awareness.setStimulusDetectionEnabled("Sound", False)
    awareness.setParameter("LookStimulusSpeed", 0.9)
    life.setState("solitary")
    assert modes() == ("Unengaged", "BodyRotation") and awareness.isStimulusDetectionEnabled("Sound")
    assert awareness.getParameter("LookStimulusSpeed") == 0.5
    wait_until(lambda: robot.truth()[5] > 0.3, "the base turns to somebody")
    life.setState("interactive")
    assert modes() == ("FullyEngaged", "BodyRotation")
    life.setState("disabled")
    assert modes() == ("Unengaged", "Head"), "as at the start: nobody who switches awareness on later turns the base"
    naoqi.ALMotion.wakeUp()


def test_life_switches_awareness_and_mood(naoqi, stranger, wait_until):
    life, mood = naoqi.ALAutonomousLife, naoqi.ALMood
    assert mood.currentPersonState()["valence"] == {"value": 0.0, "confidence": 0.0}
    assert mood.getEmotionalReaction() == "unknown"
    stranger.place(1.3, 0.0, math.pi)
    life.setState("solitary")
    assert naoqi.ALBasicAwareness.isEnabled()
    assert {"name": "BasicAwareness", "enabled": True, "running": True} in life.getAutonomousAbilitiesStatus()
    wait_until(lambda: mood.currentPersonState()["valence"]["value"] > 0.5, "the smile was seen")
    assert mood.getEmotionalReaction() == "positive"
    assert [person["userSessionID"] for person in mood.persons()] == naoqi.ALUserSession.getUserList()
    wait_until(lambda: naoqi.ALRobotMood.getState()["pleasure"] == "positive", "the robot is pleased")
    life.setState("safeguard")
    assert not naoqi.ALBasicAwareness.isEnabled()
    life.setState("disabled")
    naoqi.ALMotion.wakeUp()
