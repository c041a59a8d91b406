"""Pictures on their way: the newest one, MJPEG and WebRTC, words and times drawn into them. No ROS, no Qt."""
