"""What all robots share: safety gate, teleoperation, video, audio, web, station, simulation. It imports nothing."""
