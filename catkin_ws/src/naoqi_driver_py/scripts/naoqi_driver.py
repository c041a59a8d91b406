#!/usr/bin/env python3
"""The driver of a NAOqi robot:  rosrun naoqi_driver_py naoqi_driver.py --pip ADDRESS.  See `naoqi_driver.whole_driver`.

It stands apart from the nodes because Python looks for modules next to a program first, and there it would hide the
package of the same name from them.
"""

import sys

if __name__ == "__main__":
    sys.path.pop(0)
    from naoqi_driver.whole_driver import main

    main()
