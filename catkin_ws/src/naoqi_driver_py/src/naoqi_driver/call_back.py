"""Where the robot reaches a service of ours: over our connection, or at an address where we listen for it.

A robot whose service directory and the service that calls are one program calls over the connection that we opened. On
an ordinary Pepper they are two (NAOqi 2.5 and 2.8), and ALAudioDevice opens a connection to the address that our record
in the directory names; when it cannot, it says "Can't find service" (ros-naoqi/naoqi_driver, issues 96, 107 and 158).
So we listen, and for the robot alone: on one of this machine's addresses, for connections from the address at which the
robot answered, which reach nothing but our service.
"""

from __future__ import annotations

from telepresence.naoqi.dial import split_url
from telepresence.naoqi.limits import Limits
from telepresence.security.shared_key import is_loopback

AUTOMATIC = ""
ANYWHERE = "0.0.0.0"
"""Host of a URL that leaves the address to us, and chooses the port."""
LIMITS = Limits(
    payload=1024 * 1024,
    first_payload=16 * 1024,
    stalled_s=10.0,
    connections=8,
    login_s=5.0,
    capabilities=32,
    pending_calls=64,
    pending_bytes=4 * 1024 * 1024,
    working_calls=4,
    references=16,
    subscriptions=16,
    services=0,
)
"""What the robot may hold: a block of sound has 32 kB, and one program calls."""


def check_url(wanted: str) -> None:
    """Raises:
    ValueError: It is neither `AUTOMATIC` nor tcp://HOST:PORT.
    """
    if wanted == AUTOMATIC:
        return
    try:
        secure = split_url(wanted)[0]
    except RuntimeError as error:
        raise ValueError(f"qi_listen_url: {error}") from None
    if secure or not wanted.startswith("tcp://"):
        raise ValueError(f"qi_listen_url {wanted!r} is not tcp://HOST:PORT; port 0 takes a free one")


def listen_url(wanted: str, here: str, robot: str, encrypted: bool) -> str:
    """Return where to listen; "" for nowhere, which leaves the robot our connection.

    Args:
        wanted: A URL; with the host `ANYWHERE` the address is `here`. `AUTOMATIC`: a free port there, if the robot is
            on another machine and the link to it is not encrypted: what it sends to us there is not.
        here, robot: Addresses of both ends of the link.
    Raises:
        OSError: The URL's host has no address.
    """
    local = here == robot or is_loopback(robot)
    if wanted == AUTOMATIC:
        return "" if local or encrypted or ":" in here else f"tcp://{here}:0"
    _, host, port = split_url(wanted)
    if is_loopback(host) and not local:
        return ""  # the robot would be told an address that leads to itself
    return f"tcp://{here if host == ANYWHERE else host}:{port}"
