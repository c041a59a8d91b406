"""Plays a sound of the robot, records what its microphones pick up, and plays the recording."""

import argparse
import sys
import time

import qi


def main(session, path):
    player = session.service("ALAudioPlayer")
    recorder = session.service("ALAudioRecorder")
    audio = session.service("ALAudioDevice")

    recorder.stopMicrophonesRecording()  # left over from a program that crashed
    audio.setOutputVolume(80)
    recorder.startMicrophonesRecording(path, "wav", 16000, (0, 0, 1, 0))
    music = player.loadFile("/usr/share/naoqi/wav/random.wav")
    player.play(music, _async=True)
    time.sleep(0.6)
    position = player.getCurrentPosition(music)
    player.stopAll()
    recorder.stopMicrophonesRecording()
    print(f"position: {position:.1f} s of {player.getFileLength(music):.1f} s")
    player.unloadFile(music)
    player.playFile(path, 0.5, 0.0)
    print("played", path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--file", type=str, default="/home/nao/recordings/room.wav")
    args = parser.parse_args()
    session = qi.Session()
    try:
        session.connect(f"tcp://{args.ip}:{args.port}")
    except RuntimeError as error:
        print(error)
        sys.exit(1)
    main(session, args.file)
