"""Parts of ALAudioDevice and ALAudioRecorder: microphone buffers for clients, recording into files."""
