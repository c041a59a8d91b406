#!/usr/bin/env python3
"""The robot's camera on the pilot's screen; see telepresence_1.rob_cam_node."""

import sys

from telepresence_1.rob_cam_node import main

sys.exit(main())
