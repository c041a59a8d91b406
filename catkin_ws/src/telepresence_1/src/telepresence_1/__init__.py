"""The pilot's picture on the robot's tablet, and the robot's picture on the pilot's screen.

`com_cam_node` and `rob_cam_node` know ROS; everything else does not.
"""

from pkgutil import extend_path

# The generated messages (telepresence_1.msg) lie in the workspace's devel folder.
__path__ = extend_path(__path__, __name__)
