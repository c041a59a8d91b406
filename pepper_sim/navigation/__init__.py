"""What the robot works out about the rooms around it, from its own sensors alone: maps, its place in them, paths."""
