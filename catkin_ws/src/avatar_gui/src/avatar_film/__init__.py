"""Films what a robot's camera publishes, for the window's recordings."""
