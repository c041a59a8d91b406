"""The port on which libqi waits for the robot's calls: nobody but the robot gets through to it.

libqi listens as soon as a service is registered. It serves whoever comes, and after one connection that is reset before
it was taken it serves nobody any more (libqi, transportserverasio_p.cpp). So its socket is found among this process's
own, and

* for a robot on this machine, which calls over the link that we opened, it stops listening;
* for a robot elsewhere the kernel drops every packet that does not have the robot's address (socket filter, packet(7)),
  so that strangers neither connect nor see that the port is there.
"""

from __future__ import annotations

import contextlib
import ctypes
import ipaddress
import os
import select
import socket
import stat
import struct
from collections.abc import Iterable, Iterator
from urllib.parse import urlsplit

_SO_ATTACH_FILTER = 26
"""Source: Linux, include/uapi/asm-generic/socket.h."""
_LOAD_WORD, _IF_EQUAL, _RETURN = 0x20, 0x15, 0x06
"""Classic BPF: ld, jeq, ret. Source: Linux, Documentation/networking/filter.rst."""
_NETWORK_HEADER = 0xFFF00000
"""SKF_NET_OFF."""
_SENDER = {socket.AF_INET: 12, socket.AF_INET6: 8}
"""Where an IP header has the sender's address."""
_PASS, _DROP = 0xFFFFFFFF, 0


def close_to_strangers(endpoints: Iterable[str], robot: str) -> None:
    """Let nobody but the robot reach the ports of a session.

    Args:
        endpoints: Where the session listens: tcp://host:port.
        robot: The robot's URL.
    Raises:
        OSError: The robot's name is unknown, or this kernel has no socket filters.
    """
    addresses = _addresses(robot)
    here = any(map(_is_ours, addresses))
    for listening in _listening(endpoints):
        with contextlib.suppress(OSError) if here else contextlib.nullcontext():  # it has stopped already
            if here:
                listening.shutdown(socket.SHUT_RDWR)
            else:
                _attach(listening, addresses)
                _end_strangers(listening.getsockname()[1], addresses)


def end_stuck(endpoints: Iterable[str]) -> bool:
    """Stop listening where nobody takes the connections that wait, as after a reset by the robot itself; whether there
    was such a port."""
    stuck = False
    for listening in _listening(endpoints):
        if select.select([listening], [], [], 0.0)[0]:
            listening.shutdown(socket.SHUT_RDWR)
            stuck = True
    return stuck


def _addresses(robot: str) -> set[str]:
    host = urlsplit(robot if "://" in robot else f"tcp://{robot}").hostname or ""
    return {str(found[4][0]).partition("%")[0] for found in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)}


def _is_ours(address: str) -> bool:
    with socket.socket(socket.AF_INET6 if ":" in address else socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, 0))
        except OSError:
            return False
        return True


def _listening(endpoints: Iterable[str]) -> Iterator[socket.socket]:
    ports = {urlsplit(endpoint).port for endpoint in endpoints}
    for each in _sockets():
        if each.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN) and each.getsockname()[1] in ports:
            yield each


def _sockets() -> Iterator[socket.socket]:
    """This process's TCP sockets, each by a descriptor of ours that is closed afterwards."""
    for name in os.listdir("/proc/self/fd"):
        try:
            number = os.dup(int(name))
        except OSError:  # closed meanwhile
            continue
        if not stat.S_ISSOCK(os.fstat(number).st_mode):
            os.close(number)
            continue
        with socket.socket(fileno=number) as copy:
            if copy.family in _SENDER and copy.type == socket.SOCK_STREAM:
                yield copy


def _attach(listening: socket.socket, addresses: set[str]) -> None:
    """Drop what does not come from one of the addresses; connections that are taken later inherit that."""
    family = listening.family
    program = b"".join(
        _passes(_SENDER[socket.AddressFamily(family)], ipaddress.ip_address(address).packed)
        for address in sorted(addresses)
        if (":" in address) == (family == socket.AF_INET6)
    ) + _instruction(_RETURN, _DROP)
    buffer = ctypes.create_string_buffer(program, len(program))
    filter_ = struct.pack("HL", len(program) // 8, ctypes.addressof(buffer))
    listening.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, filter_)


def _passes(offset: int, address: bytes) -> bytes:
    """Instructions that let a packet of that sender pass, and go on to the next ones with others."""
    words = struct.unpack(f"!{len(address) // 4}I", address)
    code = b""
    for count, word in enumerate(words):
        behind = 2 * (len(words) - count) - 1  # instructions after the comparison, of those made here
        code += _instruction(_LOAD_WORD, _NETWORK_HEADER + offset + 4 * count)
        code += _instruction(_IF_EQUAL, word, 0, behind)
    return code + _instruction(_RETURN, _PASS)


def _instruction(code: int, operand: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("HBBI", code, if_true, if_false, operand)


def _end_strangers(port: int, addresses: set[str]) -> None:
    """End who came in before the filter was there."""
    for each in _sockets():
        with contextlib.suppress(OSError):  # not connected
            if each.getsockname()[1] == port and each.getpeername()[0] not in addresses:
                each.shutdown(socket.SHUT_RDWR)
