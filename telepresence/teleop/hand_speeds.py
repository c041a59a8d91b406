"""How fast a robot is driven by hand before somebody chooses: window and page start alike.

`telepresence/page/static/held.js` has the same numbers for browsers; a test compares them.
"""

from __future__ import annotations

USUAL_SPEED = 0.2
"""[m/s]; the keyboard node starts with the same speed."""
SPEED_STEP = 0.05
"""[m/s] between two positions of the slider."""
TURN_PER_SPEED = 2.5
"""[rad/s per m/s]"""
USUAL_TURN = USUAL_SPEED * TURN_PER_SPEED
"""[rad/s]"""
