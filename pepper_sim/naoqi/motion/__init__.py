"""Parts of ALMotion: base, joints, stiffness, frames, reflexes, config; bezier and move_config help them."""
