"""What the NAOqi services of the simulated Pepper are made of; the services themselves are in `pepper_sim.services`.

service             base classes of the services, the decorator `remote`, checks of arguments
extractor           base of the services that one subscribes to; sound_extractor, autonomous_ability: further bases
catalogue           makes all services of one robot
publish             from a service to the object that the server offers
tasks               threads for long calls, timed futures, ALMotion's list of tasks
client_services     calls to services that clients have registered
memory_keys         ALMemory's keys of the body; body_events: ALMemory's events of the body
joint_names, led_names, speech_languages, identity, installed_packages, time_stamp    what several services share
motion/             the parts of ALMotion
video/              the parts of ALVideoDevice
audio/              the parts of ALAudioDevice, ALAudioPlayer and ALAudioRecorder
dialog_turns        what is said to the robot, one sentence after the other; dialog_topics, dialog_settings,
                    dialog_users, dialog_knowledge: further parts of ALDialog
recognition_contexts    the grammars of ALSpeechRecognition

The messages themselves are `telepresence.naoqi`'s.
"""
