"""The pilot's page as a ROS node; its core is `telepresence.page`."""
