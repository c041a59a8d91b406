"""Records a short film into the robot's folder of recordings."""

import argparse
import time

import qi


def main(session, seconds):
    video_recorder = session.service("ALVideoRecorder")
    video_recorder.setResolution(1)
    video_recorder.setFrameRate(10)
    video_recorder.setVideoFormat("MJPG")
    video_recorder.startRecording("/home/nao/recordings/cameras", "myvideo")
    print("Video record started.")
    time.sleep(seconds)
    video_info = video_recorder.stopRecording()
    print(f"Video was saved on the robot: {video_info[1]}")
    print(f"Num frames: {video_info[0]}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1", help="Robot IP address")
    parser.add_argument("--port", type=int, default=9559, help="NAOqi port number")
    parser.add_argument("--seconds", type=float, default=5.0)
    args = parser.parse_args()
    session = qi.Session()
    session.connect(f"tcp://{args.ip}:{args.port}")
    main(session, args.seconds)
