"""Joint and chain names as ALMotion takes them: one name, or a list; each a joint, a chain or a group.

Order of the groups: NAOqi 2.8 documentation, bodyparts_pep.
"""

from __future__ import annotations

from typing import Any

from pepper_sim.body.description import JOINTS, LEG_JOINTS
from pepper_sim.naoqi.service import ServiceError, finite, shown

_ARM = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw", "Hand")
HEAD = ("HeadYaw", "HeadPitch")
LEFT_ARM = tuple("L" + joint for joint in _ARM)
RIGHT_ARM = tuple("R" + joint for joint in _ARM)
LEG = LEG_JOINTS
HANDS = ("LHand", "RHand")
BODY = JOINTS

GROUPS: dict[str, tuple[str, ...]] = {
    "Head": HEAD,
    "LArm": LEFT_ARM,
    "RArm": RIGHT_ARM,
    "Arms": (*LEFT_ARM, *RIGHT_ARM),
    "Leg": LEG,
    "Legs": LEG,
    "Body": BODY,
    "JointActuators": BODY,
    "Joints": tuple(joint for joint in BODY if joint not in HANDS),
    "Actuators": HANDS,
    "Hands": HANDS,
    "LHand": ("LHand",),
    "RHand": ("RHand",),
}
CHAINS = ("Head", "LArm", "Leg", "RArm")
STIFFNESS = {joint: f"{joint}/Stiffness" for joint in BODY}
"""Joint -> what a motion task books that changes its stiffness and not its angle."""


def joints_of(names: Any, argument: str = "names") -> list[str]:
    """Return the joints that `names` stands for, in order.

    Raises:
        ServiceError: Not a name or list of names, or one that is unknown.
    """
    if isinstance(names, str):
        names = [names]
    if not isinstance(names, list | tuple) or not names:
        raise ServiceError(f"{argument} must be a name or a list of names, got {shown(names)}")
    joints: list[str] = []
    for name in names:
        if isinstance(name, str) and name in GROUPS:
            joints += GROUPS[name]
        elif isinstance(name, str) and name in BODY:
            joints.append(name)
        else:
            raise ServiceError(f"{argument}: unknown joint or chain {shown(name)}")
    return joints


def per_joint(names: Any, values: Any) -> Any:
    """Return `values`; where they are a list with one entry per name and a name is a chain, with one per joint.

    Raises:
        ServiceError: As of `joints_of`.
    """
    if not isinstance(names, list | tuple) or not isinstance(values, list | tuple) or len(names) != len(values):
        return values
    return [value for name, value in zip(names, values, strict=True) for _ in joints_of(name)]


def values_for(joints: list[str], values: Any, argument: str, *, spread: bool = False) -> dict[str, float]:
    """Return joint -> number from one number or a list.

    Args:
        spread: One number applies to all joints; otherwise it is accepted for a single joint only.
    Raises:
        ServiceError: There are too few or too many numbers, or one is not finite.
    """
    if isinstance(values, list | tuple):
        numbers = [finite(value, f"{argument}[{index}]") for index, value in enumerate(values)]
    else:
        numbers = [finite(values, argument)] * (len(joints) if spread else 1)
    if spread and len(numbers) == 1:
        numbers *= len(joints)
    if len(numbers) != len(joints):
        raise ServiceError(f"{argument} holds {len(numbers)} values for {len(joints)} joints")
    return dict(zip(joints, numbers, strict=True))
