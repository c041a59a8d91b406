"""Which sockets listen, and where the table of sockets says so."""

import os
import socket
import subprocess
import sys

import pytest
import socket_table

from telepresence.station.listening_sockets import Listening


def test_sockets_that_others_can_send_to_are_found_and_no_others():
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_server(("::", 0), family=socket.AF_INET6) as everywhere,
        socket.create_connection(server.getsockname()),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taking,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sending,
    ):
        taking.bind(("127.0.0.1", 0))
        sending.connect(("127.0.0.1", 9))
        found = socket_table.listening_of([os.getpid()])[os.getpid()]
        wanted = (("tcp", server), ("tcp", everywhere), ("udp", taking))
        assert {Listening(protocol, *own.getsockname()[:2]) for protocol, own in wanted} <= {*found}
        assert sending.getsockname()[1] not in {one.port for one in found if one.protocol == "udp"}
        assert [one.everywhere for one in found if one.port == everywhere.getsockname()[1]] == [True]


@pytest.mark.parametrize(
    ("address", "port", "problem"),
    [("127.0.0.1", 8082, ""), ("0.0.0.0", 8082, "listens on 0.0.0.0"), ("127.0.0.1", 0, "not in the table")],
)
def test_the_table_is_compared_in_both_directions(tmp_path, address, port, problem):
    """A program of the table, a port that it may have, and one that it may not."""
    program = tmp_path / "robotino_onboard"
    program.write_text("import socket, sys\ns = socket.socket(type=socket.SOCK_DGRAM)\ns.bind((sys.argv[2], 0))\n"
                       "print(s.getsockname()[1], flush=True)\nsys.stdin.read()\n")  # fmt: skip
    running = subprocess.Popen(
        [sys.executable, program, "drive", address], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    own = int(running.stdout.readline())
    try:
        found = socket_table.compare([running.pid], "robotino", {"drive_port": own if port else own - 1})
    finally:
        running.communicate()
    about_it = [line for line in found if line.startswith("robotino_onboard drive ")]
    assert (problem in about_it[0]) if problem else not about_it
    assert any("robotino_sim" in line for line in found), "a row of which no socket is seen"
    assert any("drive" in line for line in found if line.startswith("nothing")) == (problem == "not in the table")
