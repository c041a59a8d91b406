"""Runs Debian's roslaunch with narrow sockets: `python -m telepresence_ros.roslaunch ARGUMENT ...`."""

import roslaunch

from telepresence_ros.sockets import narrow_sockets

if __name__ == "__main__":
    narrow_sockets()
    roslaunch.main()
