"""Lists what is installed, runs one behaviour to its end, and starts and stops another one."""

import argparse
import time

import qi


def behaviors(session, run_name, start_name, seconds):
    manager = session.service("ALBehaviorManager")
    names = manager.getInstalledBehaviors()
    print(len(names), "behaviors installed")

    if not manager.isBehaviorInstalled(run_name):
        print("Behavior not found: " + run_name)
        return
    manager.runBehavior(run_name)

    if manager.isBehaviorInstalled(start_name) and not manager.isBehaviorRunning(start_name):
        manager.startBehavior(start_name)
        time.sleep(seconds)
        print("running: " + " ".join(manager.getRunningBehaviors()))
        if manager.isBehaviorRunning(start_name):
            manager.stopBehavior(start_name)
    print("still running:", len(manager.getRunningBehaviors()))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559")
    parser.add_argument("--run", default="animations/Stand/Gestures/No_1")
    parser.add_argument("--start", default="animations/Stand/Waiting/AirGuitar_1")
    parser.add_argument("--seconds", type=float, default=1.0)
    arguments = parser.parse_args()
    session = qi.Session()
    session.connect(arguments.qi_url)
    behaviors(session, arguments.run, arguments.start, arguments.seconds)
