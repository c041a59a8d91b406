"""Loads a map, finds itself in it and drives to some places, one after the other."""

import sys

import qi


class Patrol:
    def __init__(self, app):
        app.start()
        self.navigation = app.session.service("ALNavigation")
        self.motion = app.session.service("ALMotion")

    def run(self, path, places):
        self.navigation.stopLocalization()
        try:
            self.navigation.loadExploration(path)
        except RuntimeError as error:
            print("no map:", error)
            return 1
        self.motion.wakeUp()
        pose, uncertainty = self.navigation.relocalizeInMap([0.0, 0.0])
        print(f"I am at {pose[0]:.1f} {pose[1]:.1f}, give or take {uncertainty[0]:.1f} m")
        self.navigation.startLocalization()
        for x, y in places:
            reached = self.navigation.navigateToInMap([x, y, 0.0])
            where = self.navigation.getRobotPositionInMap()[0]
            print(f"{x} {y}: {'reached' if reached == 0 else 'not reached'}, at {where[0]:.1f} {where[1]:.1f}")
        self.navigation.stopLocalization()
        return 0


if __name__ == "__main__":
    # --qi-url is read by the application.
    application = qi.Application(sys.argv)
    words = [word for word in sys.argv[1:] if not word.startswith("-") and "://" not in word]
    numbers = [float(word) for word in words[1:]]
    sys.exit(Patrol(application).run(words[0], list(zip(numbers[::2], numbers[1::2], strict=True))))
