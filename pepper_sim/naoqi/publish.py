"""Turns a Service into the object that libqi registers, or into the methods of the raw server."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable
from typing import Any

import qi

from pepper_sim.naoqi.raw_server import RawMethod
from pepper_sim.naoqi.service import Binding, Service, ServiceError


@qi.multiThreaded()
class _Published:
    """Holds one service's overloads and signals as attributes; libqi reads them at registration.

    Several calls may run at once, so that stopMove does not wait for moveTo.
    """


def qi_object(service: Service) -> Any:
    """Return an object for `qi.Session.registerService` with exactly the declared methods and signals."""
    published = _Published()
    for number, binding in enumerate(service.bindings()):
        setattr(published, f"{binding.name}_{number}", _bound(binding))
    for name, signal in service.signals().items():
        setattr(published, name, signal)
    return published


def raw_methods(service: Service) -> list[RawMethod]:
    """Return the declared methods for `raw_server.RawServer`, where a method may block."""

    def blocking(binding: Binding) -> Callable[..., Any]:
        def answer(*values: Any) -> Any:
            result = binding(*values)
            return result.result() if isinstance(result, concurrent.futures.Future) else result

        return answer

    return [
        RawMethod(binding.returns, binding.name, binding.parameters, blocking(binding), binding.description)
        for binding in service.bindings()
    ]


def _bound(binding: Binding) -> Callable[..., Any]:
    """Wrap an overload for libqi. An exception would reach the client as a traceback, a failed future as plain text."""

    def call(*values: Any) -> Any:
        try:
            result = binding(*values)
        except ServiceError as error:  # all that a binding raises
            promise = qi.Promise()
            promise.setError(str(error))
            return promise.future()
        return _relay(binding, result) if isinstance(result, concurrent.futures.Future) else result

    call.__doc__ = binding.description
    call.__dict__.update(
        __qi_name__=binding.name, __qi_signature__=binding.parameters, __qi_return_signature__=binding.returns
    )
    return call


def _relay(binding: Binding, work: concurrent.futures.Future) -> Any:
    """Return a qi future that ends as `work` does; cancelling it cancels `work`.

    Both drop their references to each other at the end. libqi keeps a promise's cancel callback and `work` keeps
    `finish`, a cycle that the garbage collector cannot see; and a promise that is destroyed with the interpreter aborts
    the process.
    """
    running = [work]

    def cancel(_: Any) -> None:
        for future in running:
            future.cancel()

    promises = [qi.Promise(cancel)]
    answer = promises[0].future()

    def finish(done: concurrent.futures.Future) -> None:
        running.clear()
        promise = promises.pop()
        if done.cancelled():
            promise.setCanceled()
        elif (error := done.exception()) is not None:
            promise.setError(str(binding.explain(error)))
        else:
            promise.setValue(None if binding.returns == "v" else done.result())

    work.add_done_callback(finish)
    return answer
