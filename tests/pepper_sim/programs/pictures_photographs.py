"""Takes a series of photographs, which stay on the robot."""

import argparse
import sys

import qi


def main(session):
    photo_capture = session.service("ALPhotoCapture")
    photo_capture.setResolution(2)
    photo_capture.setPictureFormat("jpg")
    photo_capture.setCaptureInterval(100)
    print(photo_capture.takePictures(3, "/home/nao/recordings/cameras/", "image"))
    print(photo_capture.takePicture("/home/nao/recordings/cameras/", "portrait.png"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1", help="Robot IP address")
    parser.add_argument("--port", type=int, default=9559, help="NAOqi port number")
    args = parser.parse_args()
    session = qi.Session()
    try:
        session.connect("tcp://" + args.ip + ":" + str(args.port))
    except RuntimeError:
        print("Can't connect to Naoqi at ip \"" + args.ip + '" on port ' + str(args.port) + ".")
        sys.exit(1)
    main(session)
