"""A simulated Pepper that answers as NAOqi does."""
