"""What the NAOqi services of the simulated Pepper are made of; the services themselves are in `pepper_sim.services`.

service             base classes of the services, the decorator `remote`, checks of arguments
extractor           base of the services that one subscribes to; sound_extractor, autonomous_ability: further bases
catalogue           makes all services of one robot
publish             from a service to the object that libqi, or the raw server, registers
tasks               threads for long calls, timed futures, ALMotion's list of tasks
client_services     calls to services that clients have registered
memory_keys         ALMemory's keys of the body; body_events: ALMemory's events of the body
joint_names, led_names, speech_languages, identity, installed_packages, time_stamp    what several services share
motion/             the parts of ALMotion
video/              the parts of ALVideoDevice
audio/              the parts of ALAudioDevice and ALAudioRecorder
codec               the qi messaging format; raw_client, raw_server: plain Python instead of libqi, for raw data
port_probe          checks that the robot's port still accepts clients

Importing this package sets libqi's environment, which libqi reads when it is loaded, unless the caller has set it.
"""

import os

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi's own log: 0 silent, 1 fatal, 2 error, 3 warning, 4 info
# libqi 4.0.3 ends threads that were idle for some seconds with an exception. Once a server has been closed, nobody
# catches it and the process aborts. So idle threads are kept.
os.environ.setdefault("QI_EVENTLOOP_THREAD_MAX_IDLE_DURATION", "1000000000")
os.environ.setdefault("QI_MAX_MESSAGE_PAYLOAD", str(32 * 1024 * 1024))  # a longer message [bytes] ends its connection
