"""What the releases of NAOqi do differently on the wire. A client finds out by asking; this is for playing one.

Sources: the tags of libqi that went into them, see docs, and for 2.8 the types that a NAO V6 lists (lugu/qiloop,
examples/naov6/services.idl). There is no version number in the protocol.
"""

from __future__ import annotations

from dataclasses import dataclass

_SIX_FIELDS = "(sIsI[s]s)<ServiceInfo,name,serviceId,machineId,processId,endpoints,sessionId>"
_SEVEN_FIELDS = "(sIsI[s]ss)<ServiceInfo,name,serviceId,machineId,processId,endpoints,sessionId,objectUid>"

CLIENT_CAPABILITIES = {
    "ClientServerSocket": True,
    "MessageFlags": True,
    "MetaObjectCache": True,  # the gateway of 2.5 sends references in that form to everybody
    "RemoteCancelableCalls": True,
    "ObjectPtrUID": True,
    "RelativeEndpointURI": True,
}
"""What our client announces to every robot."""


@dataclass(frozen=True)
class Release:
    """One generation of robots.

    Attributes:
        version: As `RELEASES` names it.
        capabilities: What its server announces.
        service_info_signature: Of the service directory's records.
        authentication: It knows action 8 of service 0; older ones answer ERROR and expect CAPABILITY.
    """

    version: str
    capabilities: dict[str, bool]
    service_info_signature: str
    authentication: bool = True


_OLDEST = {"ClientServerSocket": True, "MessageFlags": True, "MetaObjectCache": True}
_LATER = {
    "ClientServerSocket": True,
    "MessageFlags": True,
    "MetaObjectCache": False,
    "RemoteCancelableCalls": True,
    "ObjectPtrUID": True,
}

RELEASES = {
    release.version: release
    for release in (
        Release("2.1", _OLDEST, _SIX_FIELDS, authentication=False),
        Release("2.5", {**_OLDEST, "RemoteCancelableCalls": True}, _SIX_FIELDS),
        Release("2.8", _LATER, _SIX_FIELDS),
        Release("2.9", {**_LATER, "RelativeEndpointURI": True}, _SEVEN_FIELDS),
        Release("libqi 4", {**_LATER, "RelativeEndpointURI": True}, _SEVEN_FIELDS),
    )
}
"""Version -> release: 2.1 (2014), 2.5 (2016), 2.8 (2018), 2.9 (TLS and login), and what the vendor's package of today
plays, which is no robot's."""
