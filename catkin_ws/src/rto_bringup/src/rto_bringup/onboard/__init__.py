"""Programs that run on the robot next to its own web server: drive server, camera sender, sound server. No ROS.

    python -m rto_bringup.onboard drive     velocities by UDP, gated by the robot's own sensors; needs only NumPy
    python -m rto_bringup.onboard camera    pictures by WebRTC; needs aiortc and aiohttp

Two processes, so that encoding pictures never holds up the wheels.
"""
