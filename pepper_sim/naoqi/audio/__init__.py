"""What ALAudioDevice and its neighbours are made of."""
