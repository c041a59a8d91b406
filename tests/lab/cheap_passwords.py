"""What a guess of a password costs in tests with many accounts."""

from telepresence.teleop.password_key import Cost

CHEAP = Cost(1, 8, 1)
"""The least that Argon2id does."""
