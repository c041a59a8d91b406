"""Pictures: the newest one, JPEG, MJPEG and WebRTC streams, text and time drawn into them. No ROS, no Qt."""
