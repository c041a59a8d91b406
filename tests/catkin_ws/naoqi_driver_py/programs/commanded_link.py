"""A link to NAOqi in a process of its own, which may be on another machine; see `talker.Caller`."""

import json
import sys

from naoqi_driver.connection import Address, Connection, RobotUnreachable


class CommandedLink:
    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def connected(self) -> bool:
        return self._connection.connected

    def say(self, sentence: str) -> bool:
        """Send a sentence and wait for nothing; return whether there was a link."""
        try:
            self._connection.call_async("ALTextToSpeech", "say", sentence)
        except RobotUnreachable:
            return False
        return True


if __name__ == "__main__":
    with Connection(Address.parse(sys.argv[1])) as connection:
        link = CommandedLink(connection)
        for line in sys.stdin:
            name, arguments = json.loads(line)
            print(json.dumps(getattr(link, name)(*arguments)), flush=True)
