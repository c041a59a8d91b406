"""Two motions want the head: the second waits for the first. With --kill the first one is ended early."""

import argparse
import time

import qi


def main(session, seconds, kill):
    motion = session.service("ALMotion")
    motion.wakeUp()
    motion.angleInterpolation(["HeadYaw", "HeadPitch"], [0.0, 0.0], 0.4, True)

    first = motion.angleInterpolation("HeadYaw", 0.8, seconds, True, _async=True)
    time.sleep(0.2)
    print("head free:", motion.areResourcesAvailable(["HeadYaw"]))
    second = motion.angleInterpolation("HeadYaw", -0.8, 0.8, True, _async=True)
    time.sleep(0.2)
    print("waiting:", not second.isFinished())
    if kill:
        for name, number in [task[:2] for task in motion.getTaskList()]:
            print("killing", name, motion.killTask(number))
    first.wait()
    print("first ended at", round(motion.getAngles("HeadYaw", True)[0], 1))
    second.wait()
    print("second ended at", round(motion.getAngles("HeadYaw", True)[0], 1))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--kill", action="store_true")
    args = parser.parse_args()
    session = qi.Session()
    session.connect("tcp://" + args.ip + ":" + str(args.port))
    main(session, args.seconds, args.kill)
