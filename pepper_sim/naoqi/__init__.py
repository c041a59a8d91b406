"""What the NAOqi services of the simulated Pepper are made of; the services themselves are in `pepper_sim.services`.

Importing this package sets libqi's environment, which it reads when it is loaded, unless the caller has set it.
"""

import os

os.environ.setdefault("QI_LOG_LEVEL", "1")  # 0 silent, 1 fatal, 2 error, 3 warning, 4 info: libqi's own log
# libqi 4.0.3 ends threads that were idle for some seconds by an exception that nobody catches once a server was closed:
# it aborts the process. So they are kept.
os.environ.setdefault("QI_EVENTLOOP_THREAD_MAX_IDLE_DURATION", "1000000000")
os.environ.setdefault("QI_MAX_MESSAGE_PAYLOAD", str(32 * 1024 * 1024))  # a longer message [bytes] ends its connection
