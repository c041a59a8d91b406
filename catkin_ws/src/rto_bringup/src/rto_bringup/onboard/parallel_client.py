"""A Robotino whose sensors are asked side by side: a reading is as old as the slowest of its answers, not as all of
them together."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

from rto_node.client import Odometry, RobotinoClient


class ParallelClient(RobotinoClient):
    """Asks for bumper and odometry whenever it asks for the distances, over connections of their own; `bumper` and
    `odometry` return what was answered then, once for each `distances`.

    Args:
        address: The robot's web server.
        timeout: Seconds to connect, and to wait for each answer.
    """

    def __init__(self, address: str, timeout: float) -> None:
        super().__init__(address, timeout)
        self._clients = [RobotinoClient(address, timeout) for _ in range(2)]
        self._threads = [ThreadPoolExecutor(1, name) for name in ("bumper", "odometry")]
        self._bumper: Future[bool] | None = None
        self._odometry: Future[Odometry] | None = None

    def distances(self) -> tuple[float, ...]:
        self._bumper = self._threads[0].submit(self._clients[0].bumper)
        self._odometry = self._threads[1].submit(self._clients[1].odometry)
        try:
            return super().distances()
        finally:  # each ends within its time, and none is left for the next cycle to wait for
            asked: tuple[Future[Any], ...] = (self._bumper, self._odometry)
            wait(asked)

    def bumper(self) -> bool:
        """Raises RobotinoError, as `odometry` does."""
        assert self._bumper is not None, "the distances come first"
        return self._bumper.result()

    def odometry(self) -> Odometry:
        assert self._odometry is not None, "the distances come first"
        return self._odometry.result()

    def end(self) -> None:
        """No question follows. `close`, in contrast, is done to each connection that the robot has closed."""
        self.close()
        for thread, client in zip(self._threads, self._clients, strict=True):
            thread.submit(client.close)
            thread.shutdown()
