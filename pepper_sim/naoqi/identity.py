"""What this robot says it is: names, versions and serial numbers that several services return.

Values are those of a Pepper 1.0 with the older (Xtion) head, marked as simulated where a real robot has a serial
number.
"""

ROBOT_TYPE = "Pepper"
ROBOT_NAME = "Pepper"
MODEL_TYPE = "JULIETTE_Y20"
HEAD_VERSION = "VERSION_10"
BODY_VERSION = "VERSION_10"
ARM_VERSION = "VERSION_10"
SERIAL = "SIMULATED0000000000"

IDENTITY_KEYS: dict[str, str] = {
    "RobotConfig/Head/FullHeadId": SERIAL,
    "RobotConfig/Head/HeadId": SERIAL,
    "RobotConfig/Head/Version": "1.0",
    "Device/DeviceList/ChestBoard/BodyId": SERIAL,
    "RobotConfig/Body/BodyId": SERIAL,
    "RobotConfig/Body/Type": "Juliette",
    "RobotConfig/Body/BaseVersion": "V1.0",
    "RobotConfig/Body/Version": "1.0",
    "RobotConfig/Body/SoftwareRequirement": "1.0",
    "RobotConfig/Body/Device/LeftArm/Version": "1.0",
    "RobotConfig/Body/Device/RightArm/Version": "1.0",
    "RobotConfig/Body/Device/Hand/Left/Version": "1.0",
    "RobotConfig/Body/Device/Hand/Right/Version": "1.0",
    "RobotConfig/Body/Device/Legs/Version": "1.0",
    "RobotConfig/Body/Device/Platform/Version": "1.0",
    "RobotConfig/Body/Device/Brakes/Version": "1.0",
    "RobotConfig/Body/Device/Wheel/Version": "1.0",
    "Device/DeviceList/BatteryFuelGauge/SerialNumber": SERIAL,
    "Device/DeviceList/BatteryFuelGauge/FirmwareVersion": "1",
}
"""ALMemory keys that naoqi_driver reads for its `info` topic; all strings."""
