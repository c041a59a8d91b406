"""A head as the page knows it: turns as head/look says, says in head/state where it is. No robot, only topics."""

import rospy
from sensor_msgs.msg import CameraInfo
from telepresence_msgs.msg import HeadLook, HeadState

PERIOD = 0.05
AHEAD = 0.15
LIMITS = (2.0, -0.7, 0.44)
"""Left, up, down [rad]."""


class Head:
    def __init__(self):
        self.yaw, self.pitch = 0.0, AHEAD
        self.states = rospy.Publisher("/head/state", HeadState, queue_size=1)
        self.lens = rospy.Publisher("/pepper_robot/camera/front/camera_info", CameraInfo, queue_size=1, latch=True)
        self.lens.publish(CameraInfo(width=160, height=120, K=[145.0, 0, 80, 0, 145.0, 60, 0, 0, 1]))
        rospy.Subscriber("/head/look", HeadLook, self.look, queue_size=1)

    def look(self, message):
        if message.manner == HeadLook.GOAL:
            self.yaw, self.pitch = message.yaw, message.pitch
        elif message.manner == HeadLook.RATE:
            self.yaw += message.yaw * PERIOD
            self.pitch += message.pitch * PERIOD
        elif message.manner == HeadLook.AHEAD:
            self.yaw, self.pitch = 0.0, AHEAD
        self.tell()

    def tell(self, _event=None):
        left, up, down = LIMITS
        self.states.publish(HeadState(yaw=self.yaw, pitch=self.pitch, left=left, up=up, down=down, ahead=AHEAD))


def main():
    rospy.init_node("head")
    head = Head()
    timer = rospy.Timer(rospy.Duration(0.1), head.tell)
    rospy.spin()
    timer.shutdown()


if __name__ == "__main__":
    main()
