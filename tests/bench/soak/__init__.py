"""`./stack bench soak`: hours of driving, restarts, cuts and viewers; what grows meanwhile."""
