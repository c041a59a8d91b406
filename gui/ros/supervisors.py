"""Whether the roslaunch that started the robot's programs still runs: nobody else could say that it was killed.

Every roslaunch writes the address of its own server below the parameter /roslaunch/uris, and removes it when it ends
(http://wiki.ros.org/roslaunch/Architecture). One that is killed leaves it there.
"""

from __future__ import annotations

from telepresence.station.ros_master import has_ended, master_proxy

PARAMETER = "/roslaunch/uris"
MOST = 16
"""Addresses that are looked at, the newest ones: anybody may write the parameter."""


class Supervisors:
    """Remembers which roslaunches ran."""

    def __init__(self) -> None:
        self._running: set[str] = set()
        self._gone: set[str] = set()
        self._lost = False

    def lost(self, master_uri: str, caller: str, timeout: float) -> bool:
        """Return whether one was killed after the last one was started. This asks the master and every roslaunch, and
        takes up to `timeout` seconds for each.

        Raises:
            OSError, http.client.HTTPException, xmlrpc.client.Error: The master does not answer.
        """
        code, _, listed = master_proxy(master_uri, timeout).getParam(caller, PARAMETER)
        values = listed.values() if code == 1 and isinstance(listed, dict) else ()
        addresses = {uri for uri in list(values)[-MOST:] if isinstance(uri, str)}
        self._gone &= addresses
        running = {uri for uri in addresses - self._gone if not has_ended(uri, timeout)}
        killed = (self._running - running) & addresses
        if killed:
            self._lost = True
        if running - self._running:
            self._lost = False
        self._gone |= addresses - running
        self._running = running
        return self._lost
