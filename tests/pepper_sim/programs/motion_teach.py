"""Makes an arm limp so that it can be led by hand, remembers where it is, and goes there again."""

import argparse
import sys
import time

import qi


class Teacher:
    def __init__(self, app, arm):
        app.start()
        session = app.session
        self.motion = session.service("ALMotion")
        self.posture = session.service("ALRobotPosture")
        self.arm = arm

    def record(self, wait):
        self.motion.setStiffnesses(self.arm, 0.0)
        # a limp arm does not get there, but the call must come back
        self.motion.angleInterpolation(self.arm[0] + "ShoulderPitch", -1.0, 0.3, True)
        print("stand:", self.posture.goToPosture("Stand", 0.8))
        time.sleep(wait)
        angles = self.motion.getAngles(self.arm, True)
        self.motion.stiffnessInterpolation(self.arm, 1.0, 0.2)
        return angles

    def play(self, angles):
        self.motion.angleInterpolationWithSpeed(self.arm, angles, 0.4)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", type=str, default="tcp://127.0.0.1:9559")
    parser.add_argument("--arm", choices=["LArm", "RArm"], default="LArm")
    parser.add_argument("--wait", type=float, default=0.5)
    args = parser.parse_args()
    app = qi.Application([sys.argv[0], "--qi-url=" + args.qi_url])
    teacher = Teacher(app, args.arm)
    angles = teacher.record(args.wait)
    teacher.motion.setAngles(args.arm[0] + "ShoulderPitch", 0.2, 0.5)
    time.sleep(0.8)
    teacher.play(angles)
    print("learned:", " ".join(f"{angle:.2f}" for angle in angles))
