"""Sound devices and GStreamer pipelines that reopen after an error. Needs Debian's python3-gst-1.0; no ROS, no Qt."""
