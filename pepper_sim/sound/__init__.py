"""What the robot plays, says and hears. No NAOqi words."""
