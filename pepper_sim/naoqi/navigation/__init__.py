"""ALNavigation's methods: maps, free zones, and the thread and the wheels that the robot's navigation runs on."""
