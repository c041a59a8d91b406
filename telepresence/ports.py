"""The ports at which a station's programs and the robots listen, unless told otherwise. Launch files have the same.

Who may come in at each of them is in docs/security.md. What runs alone on a robot has its own copy: a test compares.
"""

from __future__ import annotations

NAOQI = 9559
"""Pepper's messaging, tcp (NAOqi's documentation)."""
PEPPER_DRIVE = 8085
"""Pepper's drive server, udp."""
OWNER_PAGE = 8081
"""The page of a simulated Pepper for its owner, tcp."""
TABLET_PAGE = 10002
"""The page that Pepper's tablet shows, tcp (the report)."""
RTP_SOUND = 10001
"""The pilot's voice as RTP, udp (the report)."""
ROBOT_PICTURES = 10004
"""The page with the robot's pictures where the report's window has no display, tcp."""

ROBOTINO_DRIVE = 8082
"""Robotino's drive server, udp."""
ROBOTINO_CAMERA = 8083
"""Its camera's signalling for WebRTC, tcp."""
ROBOTINO_SOUND = 8084
"""Its sound's signalling for WebRTC, tcp."""

WALKER = 8090
"""The simulated walker's web server, tcp."""

PILOT_PAGE = 8443
"""The pilot's page, tcp; pictures and commands go by udp ports of their own."""
SCREEN_PAGE = 10003
"""The page of the virtual display, tcp."""
