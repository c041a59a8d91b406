"""The switch of the careful scan, beside a safety gate with nine infrared beams; the same wherever the gate runs.

Publishes:  careful (std_msgs/String, latched): "on" or "off" when somebody has chosen, "on by default" or "off by
            default" when nobody has, or "unavailable: <a sentence that says why>".
Services:   set_careful (std_srvs/SetBool).
Parameters: ~careful (auto): true, false, or auto, which is on, but off with ~laser (false): the robot carries a laser
            scanner.
"""

from __future__ import annotations

from collections.abc import Callable

import rospy
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse

from telepresence_ros.kept_state import KeptState

AUTO = "auto"
SENTENCES = {
    True: "Careful scan is on: the body sways while the robot drives, to see what lies between two sensors.",
    False: "Careful scan is off: what lies between two sensors is not seen.",
}


class CarefulSwitch:
    """Reads the parameters, reports the state, and serves the service once it is started.

    Args:
        switch: Called with true or false, at once and whenever somebody switches, then on a thread of its own.
        kept: What is kept of a run of this node that has died.
        on_choice: Called after somebody has switched, on the same thread.
        unavailable: Why this gate has no careful scan; empty if it has one.
    Raises:
        SystemExit: ~careful has no valid value.
    """

    def __init__(
        self,
        switch: Callable[[bool], None],
        kept: KeptState,
        on_choice: Callable[[], None],
        unavailable: str = "",
    ) -> None:
        self._switch, self._on_choice = switch, on_choice
        self._unavailable = unavailable
        self._states = rospy.Publisher("careful", String, queue_size=1, latch=True)
        wanted = rospy.get_param("~careful", AUTO)
        if wanted not in (True, False, AUTO):
            raise SystemExit(f"{rospy.get_name()}: careful must be true, false or {AUTO}, not {wanted!r}")
        self._choice = None if unavailable else kept.choice("careful", quiet=True)
        by_default = self._choice is None and wanted == AUTO
        if self._choice is not None:
            on = self._choice
        else:
            on = not unavailable and (not rospy.get_param("~laser", False) if by_default else bool(wanted))
        switch(on)
        self._report(f"unavailable: {unavailable}" if unavailable else _word(on) + " by default" * by_default)

    def start(self) -> None:
        """Let people switch from now on."""
        rospy.Service("set_careful", SetBool, self._on_set)

    @property
    def kept(self) -> dict[str, bool | str]:
        """What somebody has chosen, to be kept; empty if nobody has."""
        return {} if self._choice is None else {"careful": self._choice}

    def _on_set(self, request: SetBoolRequest) -> SetBoolResponse:
        if self._unavailable:
            return SetBoolResponse(False, self._unavailable)
        self._choice = bool(request.data)
        self._switch(request.data)
        self._report(_word(request.data))
        rospy.loginfo("%s", SENTENCES[request.data])
        self._on_choice()
        return SetBoolResponse(True, SENTENCES[request.data])

    def _report(self, state: str) -> None:
        self._states.publish(state)


def _word(on: bool) -> str:
    return "on" if on else "off"
