"""The bytes of one TCP or TLS connection: messages in, messages out, and nobody waits for a slow peer.

Whoever sends writes at once if nothing is waiting; what the socket does not take is written by the reactor. Reading is
the reactor's alone. TLS allows no reading beside writing, so that there one lock covers both; a plain socket needs it
for writing only.
"""

from __future__ import annotations

import collections
import logging
import os
import socket
import ssl
import threading
import time
from collections.abc import Sequence
from typing import Any, Callable

from .limits import Limits
from .message import Header, MessageReader
from .reactor import READ, WRITE, Reactor
from .signature import WireError
from .socket_options import has_hung_up, prepare_to_close
from .workers import Strand

log = logging.getLogger(__name__)

_BUFFERS_AT_ONCE = 512
"""Fewer than any system's IOV_MAX."""
_TURN_BYTES = 4 * 1024 * 1024
"""Read from one connection before the others have their turn [bytes]."""
_SHORT = 16 * 1024
"""Pieces below this are queued together [bytes]."""
_LINGER_S = 1.0
"""So long a finished connection waits for the peer to close, or the last words could be lost [s]."""
_AGAIN = (BlockingIOError, InterruptedError, ssl.SSLWantReadError, ssl.SSLWantWriteError)

_handshakes = Strand()
"""TLS handshakes of the whole process, one step at a time: they may take one processor, and no more."""
os.register_at_fork(after_in_child=_handshakes.__init__)  # type: ignore[misc]


class Stream:
    """Frames messages on a connected, non-blocking socket.

    Args:
        stream: A socket, TLS included if any; its handshake need not be over.
        on_message: Called on the reactor's thread with header and payload (bytes-like) of every message.
        on_end: Called once, on any thread, with the reason.
    """

    def __init__(
        self,
        stream: socket.socket,
        reactor: Reactor,
        limits: Limits,
        on_message: Callable[[Header, Any], None],
        on_end: Callable[[str], None],
    ) -> None:
        self.limits = limits
        self.queued = 0
        self.dropped = 0
        self._socket = stream
        self._tls = isinstance(stream, ssl.SSLSocket)
        self._handshake = self._tls
        self._reactor = reactor
        self._on_message, self._on_end = on_message, on_end
        self._lock = threading.Lock()
        self._queue: collections.deque[memoryview] = collections.deque()
        self._tail = bytearray()  # short pieces behind the queue: one by one they would take ten times the memory
        self._reader = MessageReader(limits.first_payload)
        self._mask = 0
        self._paused = self._ended = self._finishing = False
        self._moved = self._read_at = time.monotonic()

    @property
    def ended(self) -> bool:
        return self._ended

    def start(self) -> None:
        """Begin to read."""
        self._reactor.call_soon(self._update)

    # --- out

    def send(self, buffers: Sequence[Any], droppable: bool = False) -> bool:
        """Send one message; return whether it was taken.

        Args:
            buffers: Bytes-like pieces; what cannot be sent at once is copied unless it is `bytes`.
            droppable: It may be left out if more than `Limits.queue_bytes` are waiting.
        """
        with self._lock:
            if self._ended or self._finishing:
                return False
            if self.queued or self._handshake:
                if droppable and self.queued > self.limits.queue_bytes:
                    self.dropped += 1
                    return False
                if self.queued > self.limits.reply_bytes:
                    reason = f"the peer does not read: {self.queued} bytes are waiting for it"
                else:
                    self._keep(buffers)
                    return True
            else:
                error = self._write_now(buffers)
                if error is None:
                    if self.queued:
                        self._reactor.call_soon(self._update)
                    return True
                reason = _why(error)
        self.end(reason, abort=True)
        return False

    def _write_now(self, buffers: Sequence[Any]) -> OSError | None:
        """Write, and keep what is not taken. The lock is held."""
        if self._tls:
            buffers = (b"".join(buffers),)  # what was tried once must be tried again in one piece
        try:
            if self._tls:
                sent, size = self._socket.send(buffers[0]), len(buffers[0])
            elif len(buffers) <= _BUFFERS_AT_ONCE:
                size = sum(map(len, buffers))
                sent = self._socket.sendmsg(buffers)
            else:
                size, sent = -1, 0
        except _AGAIN:
            size, sent = -1, 0
        except OSError as error:
            return error
        if sent != size:
            self._moved = time.monotonic()
            self._keep(buffers, sent)
        return None

    def _keep(self, buffers: Sequence[Any], skip: int = 0) -> None:
        """Queue what is left of a message after `skip` bytes. The lock is held."""
        for piece in buffers:
            size = len(piece)
            if skip >= size:
                skip -= size
                continue
            view = memoryview(piece)[skip:]
            skip = 0
            self.queued += len(view)
            if len(view) < _SHORT:
                self._tail += view
                continue
            self._seal()
            # Its owner may change it after the call.
            self._queue.append(view if isinstance(piece, bytes) else memoryview(bytes(view)))
        if len(self._tail) >= _SHORT:
            self._seal()

    def _seal(self) -> None:
        if self._tail:
            self._queue.append(memoryview(self._tail))
            self._tail = bytearray()

    def _flush(self) -> OSError | None:
        """Write what waits. The lock is held."""
        self._seal()
        queue = self._queue
        try:
            while queue:
                if self._tls:
                    sent = self._socket.send(queue[0])
                else:
                    sent = self._socket.sendmsg([queue[at] for at in range(min(len(queue), _BUFFERS_AT_ONCE))])
                self.queued -= sent
                self._moved = time.monotonic()
                while queue and sent >= len(queue[0]):
                    sent -= len(queue.popleft())
                if sent:
                    queue[0] = queue[0][sent:]
        except _AGAIN:
            return None
        except OSError as error:
            return error
        return None

    # --- in

    def trust(self) -> None:
        """Accept messages of full size: the peer is logged in."""
        self._reader.max_payload = self.limits.payload

    def pause(self) -> None:
        """Read no more until `resume`, except what has arrived already; on the reactor's thread."""
        self._paused = True
        self._update()

    def resume(self) -> None:
        """Read on; on the reactor's thread."""
        if self._paused and not self._ended:
            self._paused = False
            self._update()
            if self._tls:
                self._readable()  # what TLS has decrypted wakes nobody

    def _ready(self, mask: int) -> None:
        if self._ended:
            return
        if self._handshake:
            self._watch(0)
            return _handshakes.submit(self._shake_hands)
        if mask & WRITE or self._tls:
            with self._lock:
                error = self._flush() if self.queued else None
            if error is not None:
                return self.end(_why(error))
            if not self.queued:
                self._update()
                if self._finishing:
                    self._half_close()
        if not (mask & READ or self._tls) or self._ended:
            return
        if self._finishing:
            self._discard()
        elif not self._paused:
            self._readable()

    def _shake_hands(self) -> None:
        """A step of the TLS handshake, on a worker: a thousand of them must not hold up those who are in."""
        mask, failure = 0, ""
        with self._lock:
            if self._ended:
                return
            try:
                self._socket.do_handshake()  # type: ignore[attr-defined]
                self._handshake = False
            except ssl.SSLWantReadError:
                mask = READ
            except ssl.SSLWantWriteError:
                mask = WRITE
            except (OSError, ValueError) as error:
                failure = f"no TLS: {error}"
        if failure:
            self.end(failure)
        elif mask:
            self._reactor.call_soon(self._watch, mask)
        else:
            self._reactor.call_soon(self._update)
            self._reactor.call_soon(self._ready, READ | WRITE)

    def _receive(self, view: memoryview) -> int:
        """Read into `view`; return the number of bytes, 0 if there are none now, -1 at the end of the connection."""
        try:
            if self._tls:
                with self._lock:
                    return self._socket.recv_into(view) or -1
            return self._socket.recv_into(view) or -1
        except _AGAIN:
            return 0
        except OSError as error:
            self.end(_why(error))
            return 0

    def _readable(self) -> None:
        """Read and deliver messages until nothing is left or others should have their turn."""
        budget = _TURN_BYTES
        reader, scratch = self._reader, self._reactor.scratch_view
        try:
            while not self._ended and not self._paused:
                got = self._receive(scratch)
                if got < 0:
                    return self.end("the peer closed the connection")
                for header, payload in reader.feed(scratch[:got]):
                    self._on_message(header, payload)
                    if self._ended:
                        return
                if not reader.idle:
                    self._read_at = time.monotonic()
                budget -= got
                if got == 0 or (got < len(scratch) and not self._tls):
                    return
                if budget <= 0:
                    if self._tls:
                        self._reactor.call_soon(self._ready, READ)  # what TLS has decrypted wakes nobody
                    return
        except WireError as error:
            self.end(str(error))
        except Exception:  # a defect of ours: better no connection than one that waits for an answer
            log.exception("a message could not be handled")
            self.end("internal error")

    def _discard(self) -> None:
        """Read and forget what a peer still sends after our last words."""
        got = 1
        while got > 0 and not self._ended:
            got = self._receive(self._reactor.scratch_view)
        if got < 0:
            self.end("the conversation is over")

    # --- the end

    def end(self, reason: str, abort: bool = False) -> None:
        """Close the connection now. From any thread; only the first call has an effect.

        Args:
            abort: The peer counts as lost. Nothing is sent to it any more: the kernel would deliver what it has when
                the network is back, and the peer would carry out what nobody expects by then.
        """
        with self._lock:
            if self._ended:
                return
            self._ended = True
            self._queue.clear()
            self._tail = bytearray()
            self.queued = 0
        self._reactor.call_soon(self._close, abort)
        self._on_end(reason)

    def finish(self, reason: str) -> None:
        """Close the connection as soon as everything is sent and the peer has closed, or after a second."""
        with self._lock:
            self._finishing = True
        self._reactor.call_later(_LINGER_S, self.end, reason)
        if not self.queued:
            self._reactor.call_soon(self._half_close)

    def _half_close(self) -> None:
        if self._ended:
            return
        try:
            self._socket.shutdown(socket.SHUT_WR)
        except OSError as error:
            self.end(_why(error))

    def check(self, now: float) -> None:
        """Cut off a peer that has taken nothing, or stopped in the middle of a message, for too long."""
        patience = self.limits.stalled_s
        if self.queued and now - self._moved > patience:
            self.end(f"the peer has read nothing for {patience:g} s", abort=True)
        elif not self._reader.idle and not self._paused and now - self._read_at > patience:
            self.end(f"half a message, and nothing more for {patience:g} s", abort=True)
        elif self._paused and not self._ended and has_hung_up(self._socket):
            self.end("the peer closed the connection")  # which reading would have told

    def _close(self, abort: bool) -> None:
        self._reactor.unwatch(self._socket)
        self._mask = 0
        with self._lock:
            prepare_to_close(self._socket, discard=abort)
            try:
                self._socket.close()
            except OSError as error:
                log.debug("closing: %s", error)

    def close_copy(self) -> None:
        """Close this process's copy of the descriptor after a fork, which leaves the parent's connection alone."""
        self._ended = True
        self._socket.close()

    def _update(self) -> None:
        if not self._ended and not self._handshake:
            self._watch((0 if self._paused else READ) | (WRITE if self.queued else 0))
        elif self._handshake and not self._ended:
            self._watch(READ | WRITE)

    def _watch(self, mask: int) -> None:
        if mask != self._mask and not self._ended:
            self._mask = mask
            self._reactor.change(self._socket, mask, self._ready)


def _why(error: OSError) -> str:
    return f"the connection broke: {error.strerror or error}"
