"""Animated speech: the body moves with the words, and instructions are carried out in their turn."""

import pytest

from pepper_sim.services.al_speaking_movement import NEUTRAL, WORDS
from pepper_sim.services.al_text_to_speech import MAX_QUEUE

HEY = "animations/Stand/Gestures/Hey_1"


@pytest.fixture(autouse=True)
def body_language(naoqi):
    """Whatever other tests made of it."""
    naoqi.ALSpeakingMovement.setEnabled(True)
    naoqi.ALSpeakingMovement.setMode("contextual")


def arms_move(motion):
    return any(name == "SpeakingMovement" for name, _, _ in motion.getTaskList())


def test_the_body_speaks_and_comes_back(naoqi, wait_until):
    motion, movement = naoqi.ALMotion, naoqi.ALSpeakingMovement
    before = motion.getAngles("Body", False)
    call = naoqi.ALAnimatedSpeech.say("Hello, I am Pepper.", _async=True)
    wait_until(lambda: movement.isRunning(), "it moves while it speaks")
    wait_until(
        lambda: max(abs(a - b) for a, b in zip(motion.getAngles("Arms", True), before[2:], strict=False)) > 0.2,
        "an arm has moved",
    )
    call.value(10_000)
    wait_until(lambda: not motion.getTaskList(), "it is at rest again")
    assert not movement.isRunning()
    assert motion.getAngles("Body", False) == pytest.approx(before, abs=0.02)


def test_any_other_motion_has_precedence(naoqi, wait_until):
    motion, movement, player = naoqi.ALMotion, naoqi.ALSpeakingMovement, naoqi.ALAnimationPlayer
    player.addTagForAnimations({"dance": ["animations/Stand/Waiting/FunnyDancer_1"]})
    movement.addTagsToWords({"dance": ["hello"]})
    call = naoqi.ALAnimatedSpeech.say(
        "Hello, here is Pepper. It dances for much longer than this text takes.", _async=True
    )
    wait_until(lambda: arms_move(motion), "it moves")
    motion.angleInterpolation("RShoulderPitch", 0.0, 0.8, True)
    assert naoqi.ALMemory.getData("ALTextToSpeech/TextStarted"), "it still speaks"
    assert motion.getAngles("RShoulderPitch", True)[0] == pytest.approx(0.0, abs=0.05)
    naoqi.ALTextToSpeech.stopAll()
    call.value(5000)
    movement.resetTagsToWords()
    player.reset()


def test_without_body_language_it_only_speaks(naoqi, wait_until):
    speech, motion = naoqi.ALAnimatedSpeech, naoqi.ALMotion
    call = speech.say("^mode(disabled) Hello, I am Pepper", _async=True)
    wait_until(lambda: naoqi.ALMemory.getData("ALTextToSpeech/TextStarted"), "it speaks")
    assert not motion.getTaskList()
    naoqi.ALTextToSpeech.stopAll()
    call.value(5000)
    speech.setBodyLanguageModeFromStr("disabled")
    assert naoqi.ALSpeakingMovement.isEnabled() is False and speech.isBodyTalkEnabled() is False
    speech.setBodyLanguageMode(1)
    assert naoqi.ALSpeakingMovement.getMode() == "random" and speech.getBodyLanguageModeToStr() == "random"
    naoqi.ALSpeakingMovement.setMode("contextual")


def test_instructions_are_carried_out_in_their_turn(naoqi, wait_until):
    ends = []
    subscriber = naoqi.ALMemory.subscriber("ALAnimatedSpeech/EndOfAnimatedSpeech")
    subscriber.signal.connect(ends.append)
    memory, motion = naoqi.ALMemory, naoqi.ALMotion

    def seen_with_its_arm_up():
        """The step, and how bright the ears are."""
        motion.angleInterpolationWithSpeed("RShoulderPitch", 1.5, 0.5)  # the last try may have left it up
        memory.insertData("step", "0")
        call = naoqi.ALAnimatedSpeech.say(
            f"^mode(disabled) $step=1 ^start({HEY}) ^pCall(ALLeds.off(EarLeds)) ^start(no/such) ^wait({HEY}) $step=2"
            " ^startTag(yes) Yes ^stopTag(yes) ^call(ALLeds.setIntensity('EarLeds', 0.5)) ^dance() $step=3",
            _async=True,
        )
        wait_until(lambda: motion.getAngles("RShoulderPitch", True)[0] < 0.0 or call.isFinished(), "the arm is up")
        seen = memory.getData("step"), naoqi.ALLeds.getIntensity("EarLeds")[0]
        call.value(30_000)
        assert memory.getData("step") == "3"
        assert naoqi.ALLeds.getIntensity("EarLeds")[0] == 0.5
        return seen

    tries = []
    while ("1", 0.0) not in tries:
        assert len(tries) < 4, f"(step, ears) with the arm up: {tries}"
        tries.append(seen_with_its_arm_up())
    wait_until(lambda: len(ends) == len(tries), "its end was reported")
    assert naoqi.ALBehaviorManager.getRunningBehaviors() == []


def test_what_a_text_started_ends_with_it(naoqi, wait_until):
    motion = naoqi.ALMotion
    call = naoqi.ALAnimatedSpeech.say("^start(animations/Stand/Waiting/AirGuitar_1) Hi", _async=True)
    wait_until(lambda: naoqi.ALBehaviorManager.getRunningBehaviors(), "it plays the guitar")
    call.value(5000)
    wait_until(lambda: not motion.getTaskList(), "it has put the guitar away")


def test_words_are_linked_with_tags(naoqi, refused, simulation):
    movement = naoqi.ALSpeakingMovement
    service = next(s for s in simulation.server.catalogue.services if s.name == "ALSpeakingMovement")
    assert [tag for _, tag in service._marks("I like you?")] == ["self", "user", "interrogative"]
    movement.addTagsToWords({"hello": ["Howdy"], "no such tag": ["nobody"]})
    assert [tag for _, tag in service._marks("howdy, nobody!")] == ["hello", "exclamation"]
    movement.resetTagsToWords()
    assert "tagsToWords" in refused(movement.addTagsToWords, {"hello": "yo"})
    player = next(s for s in simulation.server.catalogue.services if s.name == "ALAnimationPlayer")
    assert all(player.tagged(tag) for tag in (*WORDS, NEUTRAL)), "every tag has an animation"


def test_a_word_late_in_a_text_has_its_animation_when_its_turn_comes(simulation):
    services = {service.name: service for service in simulation.server.catalogue.services}
    movement, player, memory = (services[f"AL{name}"] for name in ("SpeakingMovement", "AnimationPlayer", "Memory"))
    text = "Pepper-like robots stand " * 8 + "hello"
    assert movement._marks(f"{text}?") == [(24, "hello"), (24, "interrogative")]

    def animation_at(word):
        memory.store("ALTextToSpeech/CurrentWord", "stand")
        memory.store("ALTextToSpeech/PositionOfCurrentWord", word)
        return movement._choose(text, movement._marks(text))

    of_the_word = set(player.tagged("hello")) - set(player.tagged(NEUTRAL))
    assert animation_at(3) not in of_the_word and animation_at(22) in of_the_word
    memory.store("ALTextToSpeech/CurrentWord", "")


def test_a_text_that_follows_another_one_at_once_is_said_once(simulation, wait_until):
    services = {service.name: service for service in simulation.server.catalogue.services}
    speech, heard, following = services["ALAnimatedSpeech"], [], []
    unfollow = services["ALMemory"].follow("Follows/Said", heard.append)
    first = speech.say("Yes. $Follows/Said=1")
    first.add_done_callback(lambda _: following.append(speech.say("Yes. $Follows/Said=2")))
    wait_until(lambda: following, "the second text waits")
    following[0].result(10.0)
    speech.say("Yes. $Follows/Said=3").result(10.0)
    wait_until(lambda: "3" in heard, "all was said")
    unfollow()
    assert heard == ["1", "2", "3"]


def test_a_bookmark_is_reported_once_however_many_pieces_follow(simulation, wait_until):
    services, marks = {service.name: service for service in simulation.server.catalogue.services}, []
    unfollow = services["ALMemory"].follow("ALTextToSpeech/CurrentBookMark", marks.append)
    services["ALAnimatedSpeech"].say(
        r"^mode(disabled) One \mrk=5\ two ^mode(disabled) three ^mode(disabled) \mrk=6\ ^mode(disabled) four"
    ).result(20.0)
    wait_until(lambda: 6 in marks, "the last one is reported")
    unfollow()
    assert [mark for mark in marks if mark] == [5, 6]


def test_texts_that_cannot_be_said_do_not_silence_the_robot(naoqi, simulation, wait_until, refused):
    """ALDialog answers by ALAnimatedSpeech, too."""
    voice = next(s for s in simulation.server.catalogue.services if s.name == "ALTextToSpeech")
    speech, said = naoqi.ALAnimatedSpeech, []
    for _ in range(MAX_QUEUE):
        voice.speak("This takes its time. " * 20)
    calls = [speech.say(text, _async=True) for text in ("First", "Second")]
    for call in calls:
        assert "already waiting" in refused(call.value, 10_000)
    voice.stopAll()
    subscriber = naoqi.ALMemory.subscriber("ALTextToSpeech/CurrentSentence")
    subscriber.signal.connect(said.append)
    speech.say("\\rspd=9999\\ Third", _async=True).value(20_000)
    wait_until(lambda: "Third" in said, "the third was said")
