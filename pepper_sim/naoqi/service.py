"""What all NAOqi services have in common: declared methods, checked arguments, short errors, long calls.

A service is a plain object whose remote methods carry the signatures of the real robot's metaobject:

    class ALBattery(Module):
        name = "ALBattery"

        @remote("i()")
        def getBatteryCharge(self): ...

Methods run on the server's pool of threads, which all clients share, so they must return at once. One that takes time
returns a `concurrent.futures.Future`; the client's call ends when the future does, and cancelling the call cancels it.
"""

from __future__ import annotations

import concurrent.futures
import inspect
import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar, cast

from telepresence.naoqi.incoming_call import NotNow
from telepresence.naoqi.signals import Property, Signal
from telepresence.naoqi.signature import split

if TYPE_CHECKING:
    from pepper_sim.naoqi.posted_calls import PostedCalls

log = logging.getLogger(__name__)

NAOQI_VERSION = "2.5.10.7"
"""The NAOqi release whose interface is reproduced; what ALSystem.systemVersion() answers."""

_CHOICES_SHOWN = 12
_INT_RANGE = {"i": (-(2**31), 2**31 - 1), "I": (0, 2**32 - 1), "l": (-(2**63), 2**63 - 1)}


class ServiceError(RuntimeError):
    """A call cannot be carried out; the client reads its text, preceded by service and method."""


_F = TypeVar("_F", bound=Callable[..., Any])


class _Remote(Protocol):
    """A function that `remote` has marked."""

    __name__: str
    remote_signatures: tuple[str, ...]
    remote_name: str
    remote_quick: str

    def __call__(self, *values: Any) -> Any: ...


def remote(*signatures: str, name: str | None = None, quick: str = "") -> Callable[[_F], _F]:
    """Declare a method that clients may call, once per overload.

    Args:
        signatures: Return type and parameters as in a qi metaobject, for example "b(fff)".
        name: The method's remote name if the function has another one (two overloads that need two functions).
        quick: Name of a method of the same object, perhaps this one, that takes the same arguments and answers without
            waiting for the world or anybody else, or raises `NotNow`; it is asked first, on the thread that serves
            every client.
    """

    def mark(function: _F) -> _F:
        marked = cast(_Remote, function)
        marked.remote_signatures = signatures
        marked.remote_name = name or marked.__name__
        marked.remote_quick = quick
        return function

    return mark


@dataclass(frozen=True)
class Binding:
    """One overload of one method, callable with the arguments that arrived from the client.

    Raises on call: ServiceError: Wrong argument, or the method's own refusal; the text names service and method.
    """

    service: str
    name: str
    returns: str
    parameters: str
    function: Callable[..., Any]
    description: str
    arguments: tuple[tuple[str, str], ...]
    """Type and name of each argument."""
    quick: Callable[..., Any] | None = None
    """Answers at once or raises `NotNow`; see `remote`."""
    error_form: str = "{place}: {reason}"

    @classmethod
    def make(cls, service: str, signature: str, function: _Remote, error_form: str = error_form) -> Binding:
        """Bind the overload `signature`, such as "b(fff)", of a method marked with `remote`."""
        returns, parameters = split(signature)
        kinds = split(parameters[1:-1])
        names = tuple(inspect.signature(function).parameters)
        if len(names) < len(kinds):
            raise TypeError(f"{service}.{function.__name__} takes fewer arguments than {signature}")
        arguments = tuple(zip(kinds, names[: len(kinds)], strict=True))
        description = inspect.getdoc(function) or ""
        made = cls(
            *(service, function.remote_name, returns, parameters, function, description, arguments),
            error_form=error_form,
        )
        if not function.remote_quick:
            return made
        quick = getattr(cast(Any, function).__self__, function.remote_quick)
        return replace(made, quick=replace(made, function=quick))

    def __call__(self, *values: Any) -> Any:
        try:
            checked = [
                check_argument(kind, value, name) for (kind, name), value in zip(self.arguments, values, strict=True)
            ]
            result = self.function(*checked)
        except NotNow:
            raise
        except Exception as error:  # top of a remote call: the client gets every error as text
            raise self.explain(error) from None
        return None if self.returns == "v" and not isinstance(result, concurrent.futures.Future) else result

    def takes(self, *values: Any) -> bool:
        """Whether the arguments are of this overload's types."""
        try:
            for (kind, name), value in zip(self.arguments, values, strict=True):
                check_argument(kind, value, name)
        except (ServiceError, ValueError):
            return False
        return True

    def explain(self, error: BaseException) -> ServiceError:
        """Return the error that the client reads; an unexpected one is logged with its traceback."""
        place, reason = f"{self.service}::{self.name}", str(error)
        if not isinstance(error, ServiceError | ValueError):
            log.error("%s failed", place, exc_info=error)
            reason = f"internal error ({type(error).__name__}: {error})"
        return ServiceError(self.error_form.format(place=place, reason=reason))


def chosen(bindings: Iterable[Binding], name: str, arguments: Sequence[Any]) -> Binding | None:
    """Return the overload of `name` that takes the arguments, else one that takes as many, None without one."""
    fitting = [binding for binding in bindings if binding.name == name and len(binding.arguments) == len(arguments)]
    return next((binding for binding in fitting if binding.takes(*arguments)), fitting[0] if fitting else None)


class Service:
    """Base of all services. A large one is made of several objects: see `parts`.

    Attributes:
        name: What clients ask for.
        error_form: How clients read an error.
    """

    name: ClassVar[str]
    error_form: ClassVar[str] = Binding.error_form

    def parts(self) -> tuple[Any, ...]:
        """Return the objects that hold the remote methods and the signals."""
        return (self,)

    def bindings(self) -> Iterator[Binding]:
        """Return every overload of every remote method."""
        for part in self.parts():
            for attribute in dir(type(part)):
                function = getattr(type(part), attribute)
                for signature in getattr(function, "remote_signatures", ()):
                    yield Binding.make(self.name, signature, getattr(part, attribute), self.error_form)

    def signals(self) -> dict[str, Any]:
        """Return signals and properties by name: all public attributes that are one."""
        return {
            attribute: value
            for part in self.parts()
            for attribute, value in vars(part).items()
            if not attribute.startswith("_") and isinstance(value, Signal | Property)
        }

    def close(self) -> None:
        """Release threads and subscriptions; called once, after the last client."""


class Module(Service):
    """A service of the older kind, with the methods every ALModule inherits (NAOqi documentation 2.8, ALModule).

    Attributes:
        posted: The calls that `pCall` has started; set when the service is published.
    """

    posted: PostedCalls

    @remote("m(m)")
    def pCall(self, call: Any) -> int:
        """Starts a call, [method, argument, ...], and returns its number for wait, isRunning and stop."""
        return self.posted.post(call)

    @remote("i(I[m])", name="__pCall")
    def pCallByNumber(self, method: int, arguments: list) -> int:
        """The same, with the method's number instead of its name."""
        return self.posted.post_by_number(method, arguments)

    error_form = "\t{place}\n\t{reason}"  # as ALError writes it: ros-naoqi/naoqi_driver, issue 107

    @remote("b(i)")
    def isRunning(self, identity: int) -> bool:
        """Whether a call started with `pCall` still runs."""
        return self.posted.is_running(identity)

    @remote("b(ii)")
    def wait(self, identity: int, timeout: int) -> concurrent.futures.Future:
        """Waits for a call started with `pCall`; true if the timeout [ms] is over first. 0: without one."""
        return self.posted.wait(identity, timeout / 1000.0)

    @remote("v(i)", name="wait")
    def wait_for_its_end(self, identity: int) -> concurrent.futures.Future:
        """Waits without a time-out for a call started with `pCall`."""
        return self.posted.wait(identity)

    @remote("v(i)")
    def stop(self, identity: int) -> None:
        """Stops a call started with `pCall`."""
        self.posted.stop(identity)

    @remote("v()")
    def exit(self) -> None:
        """Ends the module. Ignored: the robot's own modules keep running."""

    @remote("s()")
    def getBrokerName(self) -> str:
        """Returns the name of the broker that holds the module."""
        return "MainBroker"

    @remote("[s]()")
    def getMethodList(self) -> list[str]:
        """Lists the module's methods."""
        return sorted({binding.name for binding in self.bindings()})

    @remote("m(s)")
    def getMethodHelp(self, methodName: str) -> list:
        """Describes a method: [[name, description, return type, parameter types], ...], one per overload."""
        found = [
            [binding.name, binding.description, binding.returns, binding.parameters]
            for binding in self.bindings()
            if binding.name == methodName
        ]
        if not found:
            raise ServiceError(f"unknown method '{methodName}'")
        return found

    @remote("m()")
    def getModuleHelp(self) -> list[str]:
        """Describes the module: [name, description]."""
        return [self.name, inspect.getdoc(type(self)) or ""]

    @remote("s(s)")
    def getUsage(self, methodName: str) -> str:
        """Returns a method's overloads as text."""
        return "\n".join(f"{row[2]} {row[0]}{row[3]}: {row[1]}" for row in self.getMethodHelp(methodName))

    @remote("b()")
    def ping(self) -> bool:
        """Answers true."""
        return True

    @remote("s()")
    def version(self) -> str:
        """Returns the module's version."""
        return NAOQI_VERSION


def check_argument(kind: str, value: Any, argument: str) -> Any:
    """Return `value` as the Python type of qi's type `kind`: f float, i int, s str, b bool, r bytes, [x] list, m any.

    What could be converted has been; the rest is passed on as it came, NaN included.

    Raises:
        ServiceError: It is not of that type, or a number is not finite; the text names `argument`.
    """
    if kind == "m":
        return value
    if kind in ("f", "d"):
        return finite(value, argument)
    if kind in _INT_RANGE:
        low, high = _INT_RANGE[kind]
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if not isinstance(value, int) or not low <= value <= high:
            raise ServiceError(f"{argument} must be an integer, got {shown(value)}")
        return int(value)
    if kind == "b":
        if not isinstance(value, bool | int | float):
            raise ServiceError(f"{argument} must be true or false, got {shown(value)}")
        return bool(value)
    if kind == "s":
        if not isinstance(value, str):
            raise ServiceError(f"{argument} must be a string, got {shown(value)}")
        return value
    if kind == "r":
        if not isinstance(value, bytes | bytearray):
            raise ServiceError(f"{argument} must be a buffer, got {shown(value)}")
        return value
    if kind.startswith("["):
        if not isinstance(value, list | tuple):
            raise ServiceError(f"{argument} must be a list, got {shown(value)}")
        return [check_argument(kind[1:-1], item, f"{argument}[{index}]") for index, item in enumerate(value)]
    return value


def octets(value: Any, argument: str) -> bytes | bytearray:
    """Return the bytes of an argument that is declared as a dynamic value, "m".

    Raw data arrives as it is. The vendor's Python binding sends `bytes` as a string, which arrives as text if it is
    valid UTF-8.

    Raises: ServiceError: It holds no bytes; the text names `argument`.
    """
    if isinstance(value, bytes | bytearray):
        return value
    if not isinstance(value, str):
        raise ServiceError(f"{argument} must be a buffer, got {shown(value)}")
    return value.encode()


def finite(value: Any, argument: str) -> float:
    """Return `value` as a finite float.

    Raises: ServiceError: It is not a number, or NaN, or infinite; the text names `argument`.
    """
    if not isinstance(value, int | float):
        raise ServiceError(f"{argument} must be a number, got {shown(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ServiceError(f"{argument} must be a finite number, got {shown(value)}")
    return number


def within(value: float, low: float, high: float, argument: str) -> float:
    """Return `value` if low <= value <= high.

    Raises: ServiceError: It is not; the text names `argument`.
    """
    if not low <= value <= high:
        raise ServiceError(f"{argument} must be between {low:g} and {high:g}, got {value:g}")
    return value


def one_of(value: Any, choices: Any, argument: str) -> Any:
    """Return `value` if it is one of `choices`.

    Raises: ServiceError: It is not; the text names `argument` and the choices.
    """
    if not isinstance(value, str | int) or value not in choices:
        names = [str(choice) for choice in choices]
        known = ", ".join(names[:_CHOICES_SHOWN]) + (", ..." if len(names) > _CHOICES_SHOWN else "")
        raise ServiceError(f"{argument} {shown(value)} is unknown; known: {known}")
    return value


def shown(value: Any) -> str:
    """Return `value` as text short enough for an error message."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
