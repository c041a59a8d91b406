"""Sound devices and GStreamer pipelines that come back by themselves. Needs Debian's python3-gst-1.0; no ROS, no Qt."""
