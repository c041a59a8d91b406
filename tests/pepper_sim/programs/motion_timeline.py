"""A timeline as Choregraphe exports it: the robot waves, then it goes back to its posture and rests."""

import argparse

import qi

names = list()
times = list()
keys = list()

names.append("RShoulderPitch")
times.append([0.4, 0.8, 1.2])
keys.append(
    [
        [-0.3, [3, -0.133333, 0], [3, 0.133333, 0]],
        [-0.4, [3, -0.133333, 0], [3, 0.133333, 0]],
        [-0.3, [3, -0.133333, 0], [3, 0, 0]],
    ]
)

names.append("RElbowRoll")
times.append([0.4, 0.8, 1.2])
keys.append(
    [
        [1.2, [3, -0.133333, 0], [3, 0.133333, 0]],
        [0.5, [3, -0.133333, 0.1], [3, 0.133333, -0.1]],
        [1.2, [3, -0.133333, 0], [3, 0, 0]],
    ]
)

names.append("RHand")
times.append([0.4, 1.2])
keys.append([[0.98, [3, -0.133333, 0], [3, 0.266667, 0]], [0.98, [3, -0.266667, 0], [3, 0, 0]]])


def main(session, rest):
    motion = session.service("ALMotion")
    posture = session.service("ALRobotPosture")
    motion.wakeUp()
    try:
        motion.angleInterpolation(names, [[key[0] for key in row] for row in keys], times, True)
        motion.angleInterpolationBezier(names, times, keys)
    except BaseException as err:
        print(err)
    print("hand: {:.2f}".format(motion.getAngles("RHand", True)[0]))
    print(posture.goToPosture("StandInit", 0.8), posture.getPostureFamily())
    if rest:
        motion.rest()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", type=str, default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("--rest", action="store_true")
    args = parser.parse_args()
    session = qi.Session()
    session.connect("tcp://" + args.ip + ":" + str(args.port))
    main(session, args.rest)
