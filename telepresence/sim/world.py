"""World: one MuJoCo model and its state behind one lock, stepped in real time.

The clock ticks at 200 Hz; every tick is two physics steps of 2.5 ms, so that Python runs once per two steps. Real time
is kept by sleeping to absolute deadlines: sleeping for a remainder after each step only ever falls behind.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from telepresence.sim.people import People
from telepresence.start_patience import StartPatience
from telepresence.station import heartbeat, priority

log = logging.getLogger(__name__)

TIMESTEP = 0.0025
"""Length of a physics step [s]."""
STEPS_PER_TICK = 2
TICK = TIMESTEP * STEPS_PER_TICK
"""Length of a tick [s]."""
MAX_LATENESS = 0.25
"""A stall longer than this [s] is dropped instead of being caught up at a sprint."""
FROZEN_AFTER = 2.0
"""Seconds after which a program whose physics does not go on counts as frozen; somebody may hold the world."""
SHORTEST_PAUSE = 1e-4
"""[s] after each tick, however late it is: other programs must go on when the physics takes too long."""
LOWEST_HEIGHT = -3.0
"""A body below this height [m] has fallen out of the world; the world then resets itself."""
_OUT_OF_WORLD_PERIOD = 1.0


@dataclass
class _Scheduled:
    period: int  # ticks
    due: int  # tick number
    callback: Callable[[float], None]


class _Held:
    """Context manager of `World.locked`; a class because a generator costs a microsecond per use."""

    def __init__(self, lock: threading.RLock, data: mujoco.MjData) -> None:
        self._lock = lock
        self._data = data

    def __enter__(self) -> mujoco.MjData:
        self._lock.acquire()
        return self._data

    def __exit__(self, *_: object) -> None:
        self._lock.release()


class _HeldIfFree:
    """Context manager of `World.locked_if_free`."""

    def __init__(self, lock: threading.RLock) -> None:
        self._lock = lock

    def __enter__(self) -> bool:
        self._held = self._lock.acquire(blocking=False)
        return self._held

    def __exit__(self, *_: object) -> None:
        if self._held:
            self._lock.release()


class World:
    """One MjModel and one MjData, one lock, one stepping thread.

    Callbacks registered with `every` and `on_reset` run with the lock held and may use `data` through `locked()`; they
    must be short. Work that may run code of others, such as completing a future, is handed to `post`.
    """

    def __init__(self, spec: mujoco.MjSpec, *, seed: int = 0) -> None:
        """Compile `spec` and compute the initial state.

        Args:
            spec: Scene with its robots; time step and integrator are set here.
            seed: Start of every random sequence; equal seeds and equal commands give equal runs of `step`.
        """
        # MuJoCo's own handler writes MUJOCO_LOG.TXT into the current folder.
        mujoco.set_mju_user_warning(_log_engine_warning)
        spec.option.timestep = TIMESTEP
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        self.model: mujoco.MjModel = spec.compile()
        self.seed = seed
        self._data = mujoco.MjData(self.model)
        self._lock = threading.RLock()
        self._held = _Held(self._lock, self._data)
        self._scheduled: list[_Scheduled] = []
        self._reset_callbacks: list[Callable[[], None]] = []
        self._close_callbacks: list[Callable[[], None]] = []
        self._posted: deque[Callable[[], None]] = deque()
        self._tick = 0
        self._stamp = time.time()
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()
        self._closed = False
        self._dropped = 0.0
        self._free_heights = _free_joint_heights(self.model)
        self._reset_state()
        self.every(_OUT_OF_WORLD_PERIOD, self._check_out_of_world)
        self.people = People(self)
        """Those who stand, sit or walk here."""

    # --- state -------------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulation time [s]. It goes on through a reset, so that schedules and stamps never run backwards."""
        return self._tick * TICK

    @property
    def tick(self) -> int:
        """Number of ticks made since the world was built."""
        return self._tick

    @property
    def stamp(self) -> float:
        """Wall-clock time of the last tick [s since 1970]."""
        return self._stamp

    @property
    def running(self) -> bool:
        """True while the stepping thread is alive."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def dropped_time(self) -> float:
        """Real time [s] that was given up because the machine could not keep pace."""
        return self._dropped

    def locked(self) -> _Held:
        """Stop the world and use its state: `with world.locked() as data`. Physics waits meanwhile."""
        return self._held

    def locked_if_free(self) -> _HeldIfFree:
        """Stop the world, as `locked` does, unless that would have to wait: `with world.locked_if_free() as held`."""
        return _HeldIfFree(self._lock)

    def rng(self, name: str) -> np.random.Generator:
        """Return a random generator for the part called `name`: the same for the same world seed and name."""
        return np.random.default_rng([self.seed, *name.encode()])

    # --- hooks -------------------------------------------------------------------------------------------------------

    def every(self, period: float, callback: Callable[[float], None], *, phase: float = 0.0) -> None:
        """Call `callback(simulation_time)` every `period` seconds, after the step, with the lock held.

        Args:
            period: Seconds of simulation time, rounded to ticks of 5 ms and at least one tick.
            callback: Must be short. An exception ends `step` or stops the stepping thread.
            phase: Delay of the first call [s]; spreads slow sensors over different ticks.
        """
        ticks = max(1, round(period / TICK))
        with self._lock:
            self._scheduled.append(_Scheduled(ticks, self._tick + max(1, round(phase / TICK)), callback))

    def on_reset(self, callback: Callable[[], None]) -> None:
        """Call `callback()` during every reset, lock held, before derived quantities are computed."""
        with self._lock:
            self._reset_callbacks.append(callback)

    def on_close(self, callback: Callable[[], None]) -> None:
        """Call `callback()` once when the world closes, after the last tick."""
        with self._lock:
            self._close_callbacks.append(callback)

    def post(self, callback: Callable[[], None]) -> None:
        """Run `callback()` soon, outside the lock, on the thread that steps."""
        self._posted.append(callback)

    # --- running -----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Start stepping in real time.

        Raises:
            RuntimeError: The world runs already or is closed.
        """
        if self._closed:
            raise RuntimeError("this world is closed; build a new one")
        if self._thread is not None:
            raise RuntimeError("this world is already running")
        self._closing.clear()
        self._thread = threading.Thread(target=self._run, name="world", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop stepping and run the callbacks of `on_close`. Calling it again does nothing."""
        if self._closed:
            return
        self._closed = True
        self._closing.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout=5.0)
            if self._thread.is_alive():
                log.error("the stepping thread did not end within 5 s")
        for callback in self._close_callbacks:
            callback()
        self._run_posted()

    def __enter__(self) -> World:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def step(self, ticks: int = 1) -> None:
        """Make `ticks` ticks of 5 ms at once, as fast as possible.

        Raises:
            RuntimeError: The world runs in real time.
        """
        if self.running:
            raise RuntimeError("the world runs in real time; step() is for a world that was not started")
        for _ in range(ticks):
            self._make_tick()

    def reset(self) -> None:
        """Return to the initial state, at any time and from any thread; clients stay connected, time goes on."""
        with self._lock:
            self._reset_state()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _reset_state(self) -> None:
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, self._data, 0)
        else:
            mujoco.mj_resetData(self.model, self._data)
        for callback in self._reset_callbacks:
            callback()
        mujoco.mj_forward(self.model, self._data)
        self._data.time = self.time

    def _make_tick(self) -> None:
        with self._lock:
            data = self._data
            mujoco.mj_step(self.model, data, nstep=STEPS_PER_TICK)
            self._tick += 1
            self._stamp = time.time()
            now = self.time
            if data.time < now - 0.5 * TICK:  # the engine reset itself: not-a-number or huge accelerations
                log.error("the physics became unstable at %.3f s and the world was reset", now)
                self._reset_state()
            for entry in self._scheduled:
                if self._tick >= entry.due:
                    entry.due = self._tick + entry.period
                    entry.callback(now)
        if self._posted:
            self._run_posted()

    def _run_posted(self) -> None:
        while self._posted:
            callback = self._posted.popleft()
            try:
                callback()
            except Exception:  # other people's code: it must not stop the world
                log.exception("a completion callback failed")

    def _run(self) -> None:
        priority.put_thread_first(children_too=False)
        try:
            self._keep_pace()
        except Exception:  # the top of a thread; `running` shows that it has ended
            log.critical("the world stopped stepping", exc_info=True)
            return  # without a sign that it rests: whoever started this program starts it again
        heartbeat.rest()

    def _keep_pace(self) -> None:
        deadline = time.monotonic()
        starts = StartPatience()  # a station that comes up keeps the processors busy: nothing to act on
        while not self._closing.is_set():
            heartbeat.beat(within=FROZEN_AFTER)
            deadline += TICK
            late = time.monotonic() - deadline
            time.sleep(max(-late, SHORTEST_PAUSE))
            if late > MAX_LATENESS:
                self._dropped += late
                deadline += late
                level = logging.WARNING if starts.over else logging.INFO
                log.log(level, "the simulation fell %.2f s behind real time and let that time go", late)
            self._make_tick()

    def _check_out_of_world(self, now: float) -> None:
        if len(self._free_heights) and self._data.qpos[self._free_heights].min() < LOWEST_HEIGHT:
            log.warning("something fell out of the world at %.1f s; the world was reset", now)
            self._reset_state()


def _log_engine_warning(text: str) -> None:
    log.warning("MuJoCo: %s", text)


def _free_joint_heights(model: mujoco.MjModel) -> np.ndarray:
    """Return the indices in qpos of the height of every free body."""
    free = model.jnt_type == mujoco.mjtJoint.mjJNT_FREE
    return model.jnt_qposadr[free] + 2
