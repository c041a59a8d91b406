"""What ALMotion is made of."""
