"""Joint trajectories and named poses. `trajectory` and `poses` do not know ROS."""
