"""Turns a Service into the object that the server offers to clients."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable
from typing import Any

from pepper_sim.naoqi.posted_calls import PostedCalls
from pepper_sim.naoqi.service import Binding, Module, Service
from telepresence.naoqi.future import Promise
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.signals import Property

_INHERITED = {
    **{"exit()": 100, "__pCall(I[m])": 101, "pCall(m)": 102, "version()": 103, "ping()": 104, "getMethodList()": 105},
    **{"getMethodHelp(s)": 106, "getModuleHelp()": 107, "wait(ii)": 108, "wait(i)": 109, "isRunning(i)": 110},
    **{"stop(i)": 111, "getBrokerName()": 112, "getUsage(s)": 113},
}
"""Numbers of what every ALModule inherits; its own follow (lugu/qiloop, examples/naov6/services.idl)."""


def served_object(service: Service) -> ServedObject:
    """Return an object for `telepresence.naoqi.server.Server.register` with exactly the declared methods and signals.

    Several calls may run at once, so that stopMove does not wait for moveTo.
    """
    served = ServedObject(parallel=True, strict=False)
    numbers = _INHERITED if isinstance(service, Module) else {}
    methods: dict[int, Binding] = {}
    for binding in sorted(service.bindings(), key=lambda binding: _written(binding) not in numbers):
        number = served.add_method(
            *(binding.name, binding.returns, binding.parameters, _answer(binding), binding.description),
            uid=numbers.get(_written(binding)),
            quick=binding.quick,
        )
        methods[number] = binding
    if isinstance(service, Module):
        service.posted = PostedCalls(methods)
    for name, signal in service.signals().items():
        if isinstance(signal, Property):
            served.add_property(name, signal)
        else:
            served.add_signal(name, signal)
    return served


def _written(binding: Binding) -> str:
    return f"{binding.name}{binding.parameters}"


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
