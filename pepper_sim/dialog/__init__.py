"""QiChat: topics, what a human says against their rules, what the robot answers. No NAOqi services in here."""
