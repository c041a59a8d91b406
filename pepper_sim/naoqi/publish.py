"""Turns a Service into the object that the server offers to clients."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable
from typing import Any

from pepper_sim.naoqi.service import Binding, Service
from telepresence.naoqi.future import Promise
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.signals import Property


def served_object(service: Service) -> ServedObject:
    """Return an object for `telepresence.naoqi.server.Server.register` with exactly the declared methods and signals.

    Several calls may run at once, so that stopMove does not wait for moveTo.
    """
    served = ServedObject(parallel=True, strict=False)
    for binding in service.bindings():
        served.add_method(
            *(binding.name, binding.returns, binding.parameters, _answer(binding), binding.description),
            quick=binding.quick,
        )
    for name, signal in service.signals().items():
        if isinstance(signal, Property):
            served.add_property(name, signal)
        else:
            served.add_signal(name, signal)
    return served


def _answer(binding: Binding) -> Callable[..., Any]:
    def answer(*values: Any) -> Any:
        result = binding(*values)
        return _relay(binding, result) if isinstance(result, concurrent.futures.Future) else result

    return answer


def _relay(binding: Binding, work: concurrent.futures.Future) -> Any:
    """Return a future that ends as `work` does, with the error as clients read it; cancelling it cancels `work`."""
    promise = Promise(lambda _: work.cancel())

    def finish(done: concurrent.futures.Future) -> None:
        if done.cancelled():
            promise.setCanceled()
        elif (error := done.exception()) is not None:
            promise.setError(str(binding.explain(error)))
        else:
            promise.setValue(None if binding.returns == "v" else done.result())

    work.add_done_callback(finish)
    return promise.future()
