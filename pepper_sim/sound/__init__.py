"""The robot's loudspeaker, voice and microphones, and the sounds in its room. No NAOqi words."""
