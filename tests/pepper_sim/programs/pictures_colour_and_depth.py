"""Takes a colour and a depth picture at the same time, saves the first, and says how near things are."""

import argparse
import sys

import cv2
import numpy as np
import qi

TOP, DEPTH = 0, 2
K4VGA, KQVGA = 3, 1
BGR, KDEPTH, INFRARED = 13, 17, 20


def main(session, path):
    video = session.service("ALVideoDevice")
    if not video.hasDepthCamera():
        sys.exit("this robot sees no depth")
    subscriber = video.subscribeCameras("colour_and_depth", [TOP, DEPTH], [K4VGA, KQVGA], [BGR, KDEPTH], 10)
    try:
        colour, depth = video.getImagesRemote(subscriber)
        video.setColorSpaces(subscriber, [BGR, INFRARED])
        infrared = video.getImagesRemote(subscriber)[1]
    finally:
        video.unsubscribe(subscriber)
    picture = np.frombuffer(colour[6], dtype=np.uint8).reshape((colour[1], colour[0], colour[2]))
    cv2.imwrite(path, picture)
    print(f"picture {colour[0]}x{colour[1]}")
    distances = np.frombuffer(depth[6], dtype=np.uint16).reshape((depth[1], depth[0]))
    print(f"nearest: {distances[distances > 0].min() / 1000.0:.3f} m")
    light = np.frombuffer(infrared[6], dtype=np.uint16)
    print(f"infrared: {len(light)} values up to {light.max()}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("path")
    args = parser.parse_args()
    app = qi.Application(["ColourAndDepth", f"--qi-url=tcp://{args.ip}:{args.port}"])
    app.start()
    main(app.session, args.path)
