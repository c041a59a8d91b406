#!/usr/bin/env python3
"""The pilot's camera on the robot's tablet; see telepresence_1.com_cam_node."""

import sys

from telepresence_1.com_cam_node import main

sys.exit(main())
