"""ALAudioDevice over the wire: loudspeaker queue, microphone buffers, volume."""

import time
import wave

import numpy as np
import pytest

RATE, FRAMES = 48000, 4096


def _tone(frequency, count, rate=RATE, amplitude=8000):
    mono = (amplitude * np.sin(2 * np.pi * frequency * np.arange(count) / rate)).astype("<i2")
    return np.repeat(mono, 2).tobytes()


@pytest.fixture
def audio(naoqi):
    device = naoqi.ALAudioDevice
    device.flushAudioOutputs()
    device.setParameter("outputSampleRate", RATE)
    device.muteAudioOut(False)
    device.setOutputVolume(100)
    yield device
    device.flushAudioOutputs()
    device.setOutputVolume(60)


class _Listener:
    def __init__(self):
        self.blocks = []

    def processRemote(self, channels, count, stamp, buffer):
        self.blocks.append((channels, count, stamp, buffer))


@pytest.fixture
def listen(connect, audio):
    """Register a microphone client and subscribe it."""
    open_streams = []

    def start(name, *preferences, listener=None):
        listener = listener or _Listener()
        client = connect()
        client.registerService(name, listener)
        if preferences:
            audio.setClientPreferences(name, *preferences)
        audio.subscribe(name)
        open_streams.append((name, client))
        return listener

    yield start
    for name, _ in open_streams:
        try:
            audio.unsubscribe(name)
        except RuntimeError as error:
            assert "has not subscribed" in str(error)


def test_sound_plays_at_its_rate_and_the_queue_holds_callers_back(audio, simulation):
    block = _tone(500, FRAMES)
    begin = time.monotonic()
    assert all(audio.sendRemoteBufferToOutput(FRAMES, block) for _ in range(24))  # 2.05 s of sound
    assert time.monotonic() - begin > 0.5
    assert simulation.room.loudspeaker.track.playing(begin + 1.9)
    audio.flushAudioOutputs()
    assert not simulation.room.loudspeaker.track.playing(time.monotonic() + 0.5)


def test_the_robot_hears_its_own_loudspeaker(audio, listen, wait_until):
    listener = listen("Ears", 48000, 0, 0)
    wait_until(lambda: len(listener.blocks) > 2, "blocks arrive")
    quiet = np.frombuffer(listener.blocks[-1][3], "<i2")
    before = len(listener.blocks)
    for _ in range(12):
        audio.sendRemoteBufferToOutput(FRAMES, _tone(1000, FRAMES), _async=True)

    def loud():
        """Blocks that came since, a tone's begin and end in silence left out."""
        samples = [np.frombuffer(block[3], "<i2").reshape(-1, 4).astype(float) for block in listener.blocks[before:]]
        return [
            each for each in samples if each[: FRAMES // 4, 0].std() > 20 * quiet.std() < each[-FRAMES // 4 :, 0].std()
        ]

    samples = wait_until(loud, "the tone is heard")[0][:, 2]
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    assert np.argmax(spectrum) * RATE / len(samples) == pytest.approx(1000, abs=30)


def test_microphone_blocks_are_raw_and_in_real_time(listen, wait_until):
    listener = listen("Mic48")
    wait_until(lambda: listener.blocks, "the first block arrives")
    first, begin = len(listener.blocks), time.monotonic()
    wait_until(lambda: len(listener.blocks) >= first + 12, "twelve more blocks arrive")
    assert time.monotonic() - begin > 6 * FRAMES / RATE
    channels, count, stamp, buffer = listener.blocks[-1]
    assert (channels, count) == (4, FRAMES) and isinstance(buffer, bytearray) and len(buffer) == 4 * FRAMES * 2
    assert abs(stamp[0] + stamp[1] * 1e-6 - time.time()) < 5.0
    starts = [s + us * 1e-6 for _, _, (s, us), _ in listener.blocks]
    assert np.median(np.diff(starts)) == pytest.approx(FRAMES / RATE, abs=0.02)


def test_one_channel_at_16_khz_and_a_declared_callback(qi, listen, wait_until):
    class Declared(_Listener):
        @qi.bind(qi.Void, (qi.Int32, qi.Int32, qi.Dynamic, qi.Buffer))
        def processRemote(self, channels, count, stamp, buffer):
            self.blocks.append((channels, count, stamp, buffer))

    listener = listen("Mic16", 16000, 3, 0, listener=Declared())
    wait_until(lambda: listener.blocks, "a block arrives")
    channels, count, _, buffer = listener.blocks[0]
    assert (channels, count, len(buffer)) == (1, 1365, 2730)


@pytest.mark.parametrize(
    ("preferences", "received"),
    [
        ((48000, [1, 1, 1, 1], 0, 0), (4, 4096)),
        ((48000, 0, 0, 1), (4, 4096)),
        ((16000, [0, 0, 1, 0], 0, 1), (1, 1365)),
        ((16000, (True, False, False, False), 0, 0), (1, 1365)),
    ],
)
def test_preferences_with_a_list_of_channels_and_a_timestamp(listen, wait_until, preferences, received):
    """Five parameters, as in many programs that were published for Pepper and NAO."""
    listener = listen(f"Flags{preferences[0]}", *preferences)
    wait_until(lambda: listener.blocks, "a block arrives")
    assert tuple(listener.blocks[0][:2]) == received


def test_a_list_of_channels_chooses_the_microphone_that_has_the_one(audio, simulation):
    device = next(s for s in simulation.server.catalogue.services if s.name == "ALAudioDevice")
    for number in (1, 2, 3, 4):
        audio.setClientPreferences("Chosen", 16000, [int(n == number) for n in (1, 2, 3, 4)], 0, 0)
        assert device._preferences["Chosen"].channels == number


@pytest.mark.parametrize(
    "channels", [[], [1], [0, 0, 0, 0], [1, 1, 0, 0], [0, 2, 0, 0], [0, 0, 0, 0, 1], "left", None, [[1, 1, 1, 1]]]
)
def test_lists_of_other_channels_are_refused(audio, refused, channels):
    for rate in (16000, 48000):
        assert "channelsVector" in refused(audio.setClientPreferences, "x", rate, channels, 0, 0)


def test_a_list_of_channels_that_the_rate_does_not_have_is_refused(audio, refused):
    assert "channelsVector" in refused(audio.setClientPreferences, "x", 16000, [1, 1, 1, 1], 0, 0)
    assert "channelsVector" in refused(audio.setClientPreferences, "x", 48000, [0, 1, 0, 0], 0, 0)


def test_a_quiet_room_is_nearly_silent_and_sounds_in_it_are_heard(listen, wait_until, simulation):
    listener = listen("Room", 16000, 1, 0)
    wait_until(lambda: len(listener.blocks) > 1, "blocks arrive")
    quiet = np.frombuffer(listener.blocks[-1][3], "<i2")
    assert 0 < np.abs(quiet).mean() < 40
    sound = simulation.room.surroundings.play(np.full(160_000, 0.2, np.float32), 16000)
    wait_until(lambda: np.frombuffer(listener.blocks[-1][3], "<i2").mean() > 5000, "the sound is heard")
    simulation.room.surroundings.cut(sound, sound.start)


def test_a_dead_listener_is_dropped(audio, connect, simulation, wait_until):
    client = connect()
    client.registerService("Dying", _Listener())
    audio.subscribe("Dying")
    client.close()
    device = next(s for s in simulation.server.catalogue.services if s.name == "ALAudioDevice")
    wait_until(lambda: not device._streams["Dying"].alive, "the stream ended")
    audio.unsubscribe("Dying")


def test_malformed_requests_are_refused(audio, refused):
    assert "nbOfFrames" in refused(audio.sendRemoteBufferToOutput, 0, b"")
    assert "nbOfFrames" in refused(audio.sendRemoteBufferToOutput, 16385, b"\0" * 65540)
    assert "buffer" in refused(audio.sendRemoteBufferToOutput, 100, b"\0" * 100)
    assert "buffer" in refused(audio.sendRemoteBufferToOutput, 1, [1, 2, 3])
    assert "pParamValue" in refused(audio.setParameter, "outputSampleRate", 12345)
    assert audio.getParameter("colour") == -1
    assert "channelsVector" in refused(audio.setClientPreferences, "x", 48000, 3, 0)
    assert "sampleRate" in refused(audio.setClientPreferences, "x", 44100, 0, 0)
    assert "NoSuchService" in refused(audio.subscribe, "NoSuchService")
    assert "nobody" in refused(audio.unsubscribe, "nobody")
    assert "sendRemoteBufferToOutput" in refused(audio.sendLocalBufferToOutput, 1, 0)


def test_volume_and_mute_act_on_the_sound(audio, simulation):
    track = simulation.room.loudspeaker.track
    levels = []
    for volume, mute in ((100, False), (50, False), (50, True)):
        audio.flushAudioOutputs()
        audio.setOutputVolume(volume)
        audio.muteAudioOut(mute)
        begin = time.monotonic()
        audio.sendRemoteBufferToOutput(FRAMES, _tone(500, FRAMES))
        levels.append(track.render(begin, RATE, RATE).std())
    audio.flushAudioOutputs()
    assert levels[1] == pytest.approx(levels[0] / 2, rel=0.1) and levels[2] == 0.0
    assert audio.isAudioOutMuted() is True and audio.getOutputVolume() == 50


def test_speakers_playing_is_signalled_while_sound_plays(audio, wait_until):
    events = []
    audio.speakersPlaying.connect(events.append)
    audio.playSine(440, 20, 0, 0.4)
    wait_until(lambda: events and events[-1] is False, "the end was reported")
    assert True in events


def test_energy_and_recording(audio, simulation, refused, wait_until):
    assert "enableEnergyComputation" in refused(audio.getFrontMicEnergy)
    audio.enableEnergyComputation()
    for name in ("Front", "Rear", "Left", "Right"):
        wait_until(lambda name=name: 0 < getattr(audio, f"get{name}MicEnergy")() < 100, "the room is quiet")
    audio.disableEnergyComputation()

    def recorded():
        """Seconds, of 0.4: a busy machine may begin late."""
        audio.startMicrophonesRecording("/home/nao/recording.wav")
        assert "already" in refused(audio.startMicrophonesRecording, "/home/nao/other.wav")
        time.sleep(0.4)  # of sound
        audio.stopMicrophonesRecording()
        with wave.open(str(simulation.server.catalogue.disk.path("/home/nao/recording.wav"))) as recording:
            assert recording.getnchannels() == 4 and recording.getframerate() == 48000
            return recording.getnframes() / 48000

    assert any(recorded() > 0.3 for _ in range(4))
    audio.stopMicrophonesRecording()
    audio.setFileAsInput("/home/nao/recording.wav")
    audio.closeAudioInputs()
    assert audio.isInputClosed() and not simulation.room.listen(time.monotonic(), 100, 16000).any()
    audio.openAudioInputs()
    assert not simulation.room.listen(time.monotonic() + 60.0, 100, 16000).any(), "the file is over"
    audio.setFileAsInput("")
    assert "not found" in refused(audio.setFileAsInput, "/home/nao/none.wav")
    audio.setOutputVolume(130)
    assert audio.getOutputVolume() == 100
    audio.setOutputVolume(60)
    assert ".." in refused(audio.startMicrophonesRecording, "../../etc/passwd")
