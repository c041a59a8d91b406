"""What the programs for sound say on `voice/state` (std_msgs/String), for whoever reads it. No GStreamer."""

NO_CONVERSATION = "no conversation"
"""Neither hears the other, because nobody has begun a conversation, or it has ended."""
