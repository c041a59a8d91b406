"""Programs that speak, listen and make sounds, run unchanged; what they did is in the room and on the disk."""

import subprocess
import time
import wave

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def quick_voice(naoqi):
    naoqi.ALTextToSpeech.setParameter("speed", 300.0)
    yield
    naoqi.ALTextToSpeech.resetSpeed()


@pytest.fixture
def wait_for(naoqi):
    def wait(key, value):
        deadline = time.monotonic() + 30.0
        while naoqi.ALMemory.getData(key) != value:
            assert time.monotonic() < deadline, f"{key} is {naoqi.ALMemory.getData(key)!r}"
            time.sleep(0.02)

    return wait


def _played(naoqi, since):
    """What the loudspeaker has played, at 16 kHz."""
    return naoqi.simulation.room.loudspeaker.track.render(since, int(16000 * (time.monotonic() - since)), 16000)


def test_a_human_chooses_a_drink(naoqi, start_against_robot, wait_for):
    naoqi.ALMemory.insertListData([["Dialog/Answered", ""], ["Dialog/Scope", 0]])
    begin = time.monotonic()
    program = start_against_robot("speech_dialog", stderr=subprocess.PIPE)
    wait_for("Dialog/Answered", "What would you like to drink?")
    wait_for("Dialog/Scope", 1)
    assert np.abs(_played(naoqi, begin)).max() > 0.01, "the robot asked aloud"
    naoqi.simulation.simulated.say_nearby("I would like green tea please")
    printed, errors = program.communicate(timeout=60)
    assert program.returncode == 0 and printed.splitlines() == ["topics: ['drinks']", "choice: green tea"], errors
    wait_for("Dialog/Answered", "Here is your green tea.")
    assert "drinks" not in naoqi.ALDialog.getAllLoadedTopics()


def test_a_word_turns_the_head(naoqi, start_against_robot):
    program = start_against_robot("speech_vocabulary", stderr=subprocess.PIPE)
    assert program.stdout.readline() == "listening\n"
    naoqi.simulation.simulated.say_nearby("robot look right now")
    printed, errors = program.communicate(timeout=60)
    assert program.returncode == 0 and printed == "understood: look right\n", errors
    assert naoqi.robot.snapshot().joint_positions["HeadYaw"] == pytest.approx(-0.6, abs=0.05)


def test_the_robot_records_its_own_sound(naoqi, run_against_robot):
    printed = run_against_robot("speech_recorder")
    assert "of 8.0 s" in printed and "played /home/nao/recordings/room.wav" in printed
    path = naoqi.simulation.server.catalogue.disk.path("/home/nao/recordings/room.wav")
    with wave.open(str(path)) as recording:
        samples = np.frombuffer(recording.readframes(recording.getnframes()), "<i2")
        assert (recording.getnchannels(), recording.getframerate()) == (1, 16000)
    spectrum = np.abs(np.fft.rfft(samples))
    assert 400.0 < np.argmax(spectrum) * 16000 / len(samples) < 800.0, "the notes of random.wav"
    naoqi.ALAudioDevice.setOutputVolume(60)


def test_a_name_is_pronounced(naoqi, run_against_robot):
    printed = run_against_robot("speech_dictionary")
    assert "Japanese, English, French" in printed and "maki_n16, naoenu, naofrf" in printed
    assert "volume: 1.0" in printed and "added: True" in printed and "deleted: True False" in printed
    assert "error: " in printed and "Klingon" in printed
    before, after = (naoqi.simulation.server.catalogue.disk.path(f"{name}.wav") for name in ("before", "after"))
    with wave.open(str(before)) as first, wave.open(str(after)) as second:
        assert second.getnframes() > 1.5 * first.getnframes(), "three words instead of one"
        assert first.getframerate() == 22050


def test_a_service_and_a_topic_of_the_disk_answer(naoqi, run_against_robot):
    topic = naoqi.simulation.server.catalogue.disk.path("/home/nao/parrot_enu.top")
    topic.write_text("topic: ~parrot()\nlanguage: enu\nu:({bye} bye) see you $Parrot/Left=1\n")
    printed = run_against_robot("speech_parrot").splitlines()
    assert printed == ["good morning -> you said good morning", "bye bye robot -> see you"]
    assert naoqi.ALMemory.getData("Parrot/Left") == "1"
