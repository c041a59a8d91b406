"""ALAudioPlayer and ALAudioRecorder over the wire, on the robot's own disk."""

import time
import wave

import numpy as np
import pytest

from pepper_sim.services.al_audio_player import MAX_FILES
from pepper_sim.sound.compressed import read_compressed
from pepper_sim.sound.room import sine, write_wave


@pytest.fixture
def player(naoqi, simulation):
    for name, seconds in (("tone", 0.5), ("long", 5.0)):
        write_wave(simulation.server.catalogue.disk.path(f"/home/nao/{name}.wav"), sine(440, seconds, 16000), 16000)
    service = naoqi.ALAudioPlayer
    yield service
    service.unloadAllFiles()


def test_a_file_plays_for_its_length(player, simulation):
    begin = time.monotonic()
    player.playFile("/home/nao/tone.wav")
    assert time.monotonic() - begin > 0.45


def test_loaded_files_are_paused_moved_and_unloaded(player, refused, wait_until):
    number = player.loadFile("/home/nao/long.wav")
    assert player.getFileLength(number) == pytest.approx(5.0, abs=0.01)
    assert player.getLoadedFilesIds() == [str(number)]
    call = player.play(number, _async=True)
    wait_until(lambda: player.getCurrentPosition(number) > 0.05, "the file plays")
    player.pause(number)
    call.wait(20_000)
    assert call.isFinished()
    held = player.getCurrentPosition(number)
    assert held > 0.0 and player.getCurrentPosition(number) == held
    player.goTo(number, 4.9)
    begin = time.monotonic()
    player.play(number)
    assert time.monotonic() - begin < 4.0, "the rest of the file, not the whole"
    player.setVolume(number, 0.5)
    assert player.getVolume(number) == pytest.approx(0.5)
    player.unloadFile(number)
    assert str(number) in refused(player.play, number)


def test_a_loop_plays_until_stopped(player, simulation):
    track = simulation.room.loudspeaker.track
    player.playFileInLoop("/home/nao/tone.wav")
    now = time.monotonic()
    assert track.playing(now + 30.0), "the call has ended, the sound goes on"
    player.stopAll()
    assert not track.playing(time.monotonic() + 30.0)
    player.unloadAllFiles()


@pytest.mark.parametrize(
    ("method", "arguments"),
    [
        ("playFile", ("/home/nao/long.wav",)),
        ("playFileFromPosition", ("/home/nao/long.wav", 0.5)),
        ("playSine", (440, 10, 0, 60.0)),
        ("playSoundSetFile", ("Aldebaran", "random")),
        ("playSoundSetFile", ("Aldebaran", "random", 0.0, 1.0, 0.0, True)),
    ],
)
def test_stop_all_stops_every_sound(player, simulation, wait_until, method, arguments):
    track = simulation.room.loudspeaker.track
    call = getattr(player, method)(*arguments, _async=True)
    wait_until(lambda: track.playing(time.monotonic() + 1.0), "it plays")
    player.stopAll()
    assert not track.playing(time.monotonic() + 1.0)
    call.value(10_000)


def test_a_cancelled_call_plays_no_longer(player, simulation, wait_until):
    track = simulation.room.loudspeaker.track
    call = player.playFile("/home/nao/long.wav", _async=True)
    wait_until(lambda: track.playing(time.monotonic() + 1.0), "it plays")
    call.cancel()
    wait_until(lambda: not track.playing(time.monotonic() + 1.0), "it is silent")


def test_a_loop_is_loaded_no_longer_than_it_plays(player, connect, refused):
    for _ in range(MAX_FILES + 1):
        player.playFileInLoop("/home/nao/tone.wav")
        player.stopAll()
    assert "volume" in refused(player.playFileInLoop, "/home/nao/tone.wav", 5.0, 0.0)
    client = connect()
    client.service("ALAudioPlayer").playFileInLoop("/home/nao/tone.wav")
    client.close()
    (number,) = player.getLoadedFilesIds()
    player.pause(int(number))
    player.playInLoop(int(number))
    player.stop(int(number))
    assert player.getLoadedFilesIds() == []


def test_a_loop_that_was_paused_and_is_played_to_its_end_is_loaded_no_longer(player, wait_until):
    player.playFileInLoop("/home/nao/tone.wav")
    (number,) = player.getLoadedFilesIds()
    player.pause(int(number))
    assert player.getLoadedFilesIds() == [number], "it can go on"
    player.play(int(number))
    wait_until(lambda: not player.getLoadedFilesIds(), "it is over")


def test_missing_files_and_wrong_values_are_refused(player, refused):
    assert "not found" in refused(player.playFile, "/home/nao/none.wav")
    assert ".." in refused(player.loadFile, "../../../etc/hostname")
    assert "volume" in refused(player.playFile, "/home/nao/tone.wav", 5.0, 0.0)
    assert "streams" in refused(player.playWebStream, "http://127.0.0.1/", 1.0, 0.0)
    assert "position" in refused(player.goTo, player.loadFile("/home/nao/tone.wav"), 9.0)
    assert "frequence" in refused(player.playSine, 0, 50, 0, 0.1)
    player.setMasterVolume(0.7)
    assert player.getMasterVolume() == pytest.approx(0.7)
    player.setMasterVolume(1.0)


def test_a_file_that_is_no_sound_is_refused(player, simulation, refused):
    simulation.server.catalogue.disk.path("/home/nao/text.wav").write_text("not a sound")
    assert "not a WAV file" in refused(player.loadFile, "/home/nao/text.wav")


def test_recording_chosen_microphones(naoqi, simulation, refused):
    recorder = naoqi.ALAudioRecorder
    recorder.startMicrophonesRecording("/home/nao/front.wav", "wav", 16000, [0, 0, 1, 0])
    time.sleep(0.3)  # of sound
    recorder.stopMicrophonesRecording()
    with wave.open(str(simulation.server.catalogue.disk.path("/home/nao/front.wav"))) as recording:
        assert recording.getnchannels() == 1 and recording.getframerate() == 16000 and recording.getnframes() > 3000
    assert "type" in refused(recorder.startMicrophonesRecording, "a.mp3", "mp3", 16000, [0, 0, 1, 0])
    assert "channels" in refused(recorder.startMicrophonesRecording, "a.wav", "wav", 16000, [0, 0, 0, 0])


def test_ogg_files_are_recorded_and_played(player, naoqi, simulation, refused):
    simulation.room.surroundings.play(sine(500.0, 1.0, 16000, 0.3), 16000)
    naoqi.ALAudioDevice.startMicrophonesRecording("/home/nao/front.ogg")
    time.sleep(0.4)  # of sound
    naoqi.ALAudioDevice.stopMicrophonesRecording()
    disk = simulation.server.catalogue.disk
    samples, rate = read_compressed(disk.path("/home/nao/front.ogg"))
    frequency = np.argmax(np.abs(np.fft.rfft(samples[:, 0]))) * rate / len(samples)
    assert frequency == pytest.approx(500.0, abs=10.0) and samples.shape[1] == 1
    assert not disk.path("/home/nao/front.ogg.part").exists()
    number = player.loadFile("/home/nao/front.ogg")
    assert player.getFileLength(number) == pytest.approx(len(samples) / rate, abs=0.1)
    player.unloadFile(number)
    disk.path("/home/nao/list.mp3").write_text("#EXTM3U\nhttp://127.0.0.1/x.mp3\n")
    assert "mp3" in refused(player.loadFile, "/home/nao/list.mp3")


def test_the_robot_brings_sounds(player, naoqi, refused):
    """Under the documented paths and as a sound set; a recording that does not run can be ended."""
    number = player.loadFile("/usr/share/naoqi/wav/random.wav")
    assert player.getFileLength(number) > 6.0
    assert player.loadFile("/opt/aldebaran/share/naoqi/wav/begin_reco.wav") > number
    assert player.getLoadedFilesNames()[-2:] == [
        "/usr/share/naoqi/wav/random.wav",
        "/opt/aldebaran/share/naoqi/wav/begin_reco.wav",
    ]
    assert player.isSoundSetFileInstalled("Aldebaran", "bip_gentle")
    begin, track = time.monotonic(), naoqi.simulation.room.loudspeaker.track
    player.playSoundSetFile("Aldebaran", "bip_gentle")
    assert track.render(begin, 8000, 16000).std() > 0.01, "the tone is in the room"
    assert "sound set" in refused(player.playSoundSetFile, "no_such_sound")
    player.unloadAllFiles()
    naoqi.ALAudioRecorder.stopMicrophonesRecording()
    naoqi.ALAudioDevice.stopMicrophonesRecording()
