"""The link between the pilot's machine and the robot's, with faults: cut, stalled, late, its connections reset.

Both machines are network namespaces with the kernel's own TCP and UDP; see `far_network.py`.
"""

from __future__ import annotations

import os
import socket
import struct
import time

from media.far_network import FarNetwork

RESET_LASTS = 0.3
"""Connections that carry something within this time after `reset` are reset [s]."""
_TCP = 6
_FIN, _SYN, _RST, _ACK = 1, 2, 4, 16


class BadLink(FarNetwork):
    """Two machines: `pilot` and `robot`. `cut` loses every packet; see also `delay`."""

    def __init__(self) -> None:
        super().__init__(2)
        self.pilot, self.robot = self.machines
        self._reset_until = 0.0
        self._known: set[tuple[bytes, bytes]] = set()

    def reset(self) -> None:
        """Reset every TCP connection that carries something now, at both ends, as a firewall does."""
        self._known = set()
        self._reset_until = time.monotonic() + RESET_LASTS

    def _takes(self, packet: bytes, target: int) -> bool:
        if time.monotonic() > self._reset_until or packet[9] != _TCP:
            return True
        header = (packet[0] & 15) * 4
        flags = packet[header + 13]
        flow = (packet[12:16] + packet[header : header + 2], packet[16:20] + packet[header + 2 : header + 4])
        fresh = flow not in self._known and flow[::-1] not in self._known
        self._known.add(flow)
        if not fresh or flags & (_SYN | _RST) or not flags & _ACK:
            return True  # it was reset already, or has only begun
        sequence, acknowledged = struct.unpack_from("!II", packet, header + 4)
        # Each end takes a reset whose number is exactly what it waits for next (RFC 5961).
        os.write(target, _segment(*flow, sequence))
        source = next(m.tun for m in self.machines if socket.inet_aton(m.address) == packet[12:16])
        os.write(source, _segment(*flow[::-1], acknowledged))
        return False


def _segment(source: bytes, target: bytes, sequence: int) -> bytes:
    """A TCP reset; both ends are an IPv4 address and a port, as on the wire."""
    tcp = source[4:] + target[4:] + struct.pack("!IIBBHHH", sequence, 0, 5 << 4, _RST, 0, 0, 0)
    pseudo = source[:4] + target[:4] + struct.pack("!BBH", 0, _TCP, len(tcp))
    tcp = tcp[:16] + struct.pack("!H", _checksum(pseudo + tcp)) + tcp[18:]
    ip = struct.pack("!BBHHHBBH", 0x45, 0, 20 + len(tcp), 0, 0, 64, _TCP, 0) + source[:4] + target[:4]
    return ip[:10] + struct.pack("!H", _checksum(ip)) + ip[12:] + tcp


def _checksum(data: bytes) -> int:
    """RFC 1071."""
    total = sum(struct.unpack(f"!{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF
