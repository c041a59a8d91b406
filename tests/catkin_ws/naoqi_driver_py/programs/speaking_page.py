"""The pilot's page as far as it lets the robot speak, in a process of its own; see `talker.Caller`."""

import asyncio
import json
import sys

import rospy
from pilot_page.conversation import Conversation

from telepresence.teleop.lease_messages import Account


class SpeakingPage:
    def __init__(self) -> None:
        self._conversation = Conversation(rospy.resolve_name)

    def can_say(self) -> bool:
        return self._conversation.state()["say"]

    def say(self, sentence: str) -> str:
        """Let the robot say a sentence; return why that is not possible."""
        try:
            asyncio.run(self._conversation.say(sentence, Account("anna", "pilot")))
        except ValueError as error:
            return str(error)
        return ""


if __name__ == "__main__":
    rospy.init_node("speaking_page", disable_signals=True)
    page = SpeakingPage()
    for line in sys.stdin:
        name, arguments = json.loads(line)
        print(json.dumps(getattr(page, name)(*arguments)), flush=True)
