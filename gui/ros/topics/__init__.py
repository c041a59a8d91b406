"""Topics and services of the robots as rows of their tables (`gui.robots`)."""
