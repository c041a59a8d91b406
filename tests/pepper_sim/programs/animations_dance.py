"""Installs a package that somebody copied to the robot, dances what is in it, and cleans up."""

import argparse

import qi


def main(session, package, dance):
    packages = session.service("PackageManager")
    manager = session.service("ALBehaviorManager")
    motion = session.service("ALMotion")
    packages.install(package)
    try:
        motion.wakeUp()
        print("dances: " + ", ".join(name for name in manager.getInstalledBehaviors() if name.startswith("mydances/")))
        session.service("ALAnimationPlayer").run(dance)
        print("head:", round(motion.getAngles("HeadYaw", True)[0], 1))
    finally:
        packages.removePkg("mydances")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ip", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9559)
    parser.add_argument("package")
    parser.add_argument("dance")
    arguments = parser.parse_args()
    session = qi.Session()
    session.connect("tcp://" + arguments.ip + ":" + str(arguments.port))
    main(session, arguments.package, arguments.dance)
