"""Colours the eyes in the ways that people do: by name, as 0xRRGGBB, as parts up to 1 and as parts up to 255."""

import argparse

import qi

parser = argparse.ArgumentParser()
parser.add_argument("--ip", default="127.0.0.1")
parser.add_argument("--port", type=int, default=9559)
arguments = parser.parse_args()

session = qi.Session()
session.connect(f"tcp://{arguments.ip}:{arguments.port}")
leds = session.service("ALLeds")

leds.fadeRGB("FaceLeds", "red", 0.1)
leds.fadeRGB("FaceLeds", 0x00FF00, 0.1)
leds.rotateEyes(0x0000FF, 0.2, 0.4)
leds.fadeListRGB("FaceLeds", [0xFF0000, 0xFFFF00], [0.1, 0.2])
leds.fadeRGB("FaceLeds", 0.0, 0.5, 1.0, 0.1)
leds.fadeRGB("FaceLeds", 255, 51, 0, 0.2)
print("left eye: " + " ".join(leds.listGroup("FaceLedsLeftRed")[:1]))
