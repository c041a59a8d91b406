"""Parts of ALMotion: base, joints, stiffness, frames, reflexes, config; bezier, move_config and gestures help them."""
