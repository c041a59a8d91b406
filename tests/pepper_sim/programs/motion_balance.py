"""Breathes for a while, and checks that the centre of mass stays above the wheels. Tries inverse kinematics, too."""

import argparse
import sys
import time

import qi

FRAME_TORSO, FRAME_ROBOT = 0, 2


def inside(point, polygon):
    sides = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return all((b[0] - a[0]) * (point[1] - a[1]) > (b[1] - a[1]) * (point[0] - a[0]) for a, b in sides)


def main(app, seconds):
    app.start()
    motion = app.session.service("ALMotion")
    motion.wakeUp()
    motion.setBreathConfig([["Bpm", 30.0], ["Amplitude", 1.0]])
    motion.setBreathEnabled("Body", True)
    end = time.time() + seconds
    stable, reached = True, []
    while time.time() < end:
        com = motion.getCOM("Body", FRAME_ROBOT, True)
        stable = stable and inside(com, [list(corner) for corner in motion.getSupportPolygon(FRAME_ROBOT, True)])
        reached.append(motion.getPosition("LArm", FRAME_ROBOT, True)[0])
        time.sleep(0.05)
    motion.setBreathEnabled("Body", False)
    print("stable:", stable, "of {:.1f} kg".format(motion.getMass("Body")))
    print("hand moved %.3f m" % (max(reached) - min(reached)))
    try:
        motion.setPositions("LArm", FRAME_TORSO, [0.3, 0.2, 0.1, 0.0, 0.0, 0.0], 0.3, 7)
    except RuntimeError as error:
        print("no inverse kinematics:", error)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559")
    parser.add_argument("--seconds", type=float, default=4.0)
    arguments = parser.parse_args()
    main(qi.Application([sys.argv[0], "--qi-url=" + arguments.qi_url]), arguments.seconds)
