"""What one end of the wire allows the other; all lengths, counts and times in one place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Bounds for one server or client.

    Attributes:
        payload: Largest message, without its header [bytes].
        first_payload: The same before the login [bytes].
        queue_bytes: Waiting output of a connection above which its events and posts are dropped and no further message
            is read from it [bytes].
        reply_bytes: Waiting output above which the connection is closed [bytes]; one reply of any size may wait.
        stalled_s: A peer that takes nothing of what waits for it, or stops in the middle of a message, is cut off after
            this time [s].
        connections: Connections of a server; a new one above it replaces the oldest that is not logged in, or is
            refused.
        login_s: From accept to the end of the login, TLS included [s].
        capabilities: Entries in a capability map.
        pending_calls: Calls of one connection that wait or run; above it the connection is not read on, see
            `Connection`.
        pending_bytes: The same for their arguments [bytes].
        working_calls: Calls of one connection that occupy a thread at the same time, of 256 for all.
        references: Objects passed to one peer and not released.
        subscriptions: Links of one connection to signals.
        services: Services that one connection may register.
    """

    payload: int = 64 * 1024 * 1024
    first_payload: int = 64 * 1024
    queue_bytes: int = 4 * 1024 * 1024
    reply_bytes: int = 64 * 1024 * 1024
    stalled_s: float = 30.0
    connections: int = 1000
    login_s: float = 10.0
    capabilities: int = 256
    pending_calls: int = 512
    pending_bytes: int = 128 * 1024 * 1024
    working_calls: int = 64
    references: int = 10_000
    subscriptions: int = 1000
    services: int = 256
