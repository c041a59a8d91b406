"""A web server on gevent, and what the JSON interfaces of the simulated robots share. No ROS, no Qt."""
