"""Shows what kind of robot this is, and gives it a name."""

import argparse
import xml.etree.ElementTree as ElementTree

import qi

parser = argparse.ArgumentParser()
parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559")
parser.add_argument("--name")
arguments = parser.parse_args()

session = qi.Session()
session.connect(arguments.qi_url)
system, model = session.service("ALSystem"), session.service("ALRobotModel")
network, packages = session.service("ALConnectionManager"), session.service("PackageManager")

print("version:", system.systemVersion())
print("type:", model.getRobotType())
for preference in ElementTree.fromstring(model.getConfig()):
    if preference.get("memoryName") == "RobotConfig/Body/Type":
        print("body:", preference.get("value"))
for partition in system.diskFree(True):
    print("disk:", partition["path"], partition["free"] < partition["size"])
print("network:", network.state(), [dict(service)["Type"] for service in network.services()])
print("packages:", [package["uuid"] for package in packages.packages()])
if arguments.name:
    print("renamed:", system.setRobotName(arguments.name))
