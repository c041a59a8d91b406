"""ALResourceManager: who uses which part of the robot, so that programs do not disturb each other.

Resources form a tree: who owns "Arms" owns "LArm". Whoever wants a resource that another module owns has that module's
callback called, callback(resource, owner), and gets it once it is released. Source: NAOqi 2.8 documentation,
ALResourceManager; the robot's own resources are its chains, and what it lights and sounds with.
"""

from __future__ import annotations

import concurrent.futures
import threading
from collections.abc import Iterable

from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.service import Module, ServiceError, remote, shown
from pepper_sim.naoqi.tasks import Workers

_OWN = {
    **{"Head": "", "Arms": "", "LArm": "Arms", "RArm": "Arms", "LHand": "LArm", "RHand": "RArm", "Legs": ""},
    **{"Leds": "", "FaceLeds": "Leds", "EarLeds": "Leds", "ChestLeds": "Leds", "AudioOut": "", "Standing": ""},
}
"""Resource -> the one that holds it."""
_ENDLESS = 3600.0
"""Seconds that a call without a time-out waits."""
_MOST = 10_000


class ALResourceManager(Module):
    """Lends resources to modules."""

    name = "ALResourceManager"

    def __init__(self, clients: ClientServices, workers: Workers) -> None:
        self._clients = clients
        self._workers = workers
        self._lock = threading.Lock()
        self._parents: dict[str, str] = dict(_OWN)
        self._owners: dict[str, tuple[str, str]] = {}
        """Resource -> its owner and the owner's callback."""
        self._disabled: set[str] = set()

    @remote("v(ss)")
    def createResource(self, resourceName: str, parentResourceName: str) -> None:
        """Makes a resource, in another one or, with "", in none."""
        if not resourceName:
            raise ServiceError("a resource needs a name")
        if parentResourceName:
            self._check([parentResourceName])
        with self._lock:
            if len(self._parents) >= _MOST:
                raise ServiceError(f"there are {_MOST} resources already")
            self._parents.setdefault(resourceName, parentResourceName)

    @remote("v([s]s)")
    def createResourcesList(self, resourceNameList: list[str], strModule: str) -> None:
        """Makes resources, in another one or, with "", in none."""
        for name in resourceNameList:
            self.createResource(name, strModule)

    @remote("v(s)", "v(sb)")
    def deleteResource(self, resourceName: str, deleteChildResources: bool = True) -> None:
        """Deletes a resource and those in it; the second argument has no effect."""
        self._check([resourceName])
        with self._lock:
            for name in self._inside(resourceName):
                del self._parents[name]
                self._owners.pop(name, None)
                self._disabled.discard(name)

    @remote("m()")
    def getResources(self) -> list[str]:
        """Lists the resources."""
        return list(self._parents)

    @remote("m()")
    def ownersGet(self) -> list[list[str]]:
        """Lists [resource, owner], with "" where nobody owns it."""
        with self._lock:
            return [[name, self._owners.get(name, ("", ""))[0]] for name in self._parents]

    @remote("b(s)")
    def isResourceFree(self, ResourceName: str) -> bool:
        """Whether nobody owns a resource, one of those in it, or one that holds it, and it is enabled."""
        self._check([ResourceName])
        with self._lock:
            return not self._in_the_way(ResourceName, "") and ResourceName not in self._disabled

    @remote("b([s])")
    def areResourcesFree(self, resourceNames: list[str]) -> bool:
        """Whether all of these are free."""
        return all(self.isResourceFree(name) for name in resourceNames)

    @remote("b([s]s)")
    def areResourcesOwnedBy(self, resourceNameList: list[str], ownerName: str) -> bool:
        """Whether a module owns all of these."""
        self._check(resourceNameList)
        with self._lock:
            return all(self._owners.get(name, ("", ""))[0] == ownerName for name in resourceNameList)

    @remote("b(ss)")
    def isInGroup(self, resourceGroupName: str, resourceName: str) -> bool:
        """Whether a resource is in another one."""
        self._check([resourceGroupName, resourceName])
        with self._lock:
            return resourceName in self._inside(resourceGroupName)

    @remote("v(sb)")
    def enableStateResource(self, resourceName: str, enabled: bool) -> None:
        """Enables a resource that stands for a state, such as Standing, or disables it: nobody can have it then."""
        self._check([resourceName])
        with self._lock:
            (self._disabled.discard if enabled else self._disabled.add)(resourceName)

    @remote("v(sssi)")
    def acquireResource(
        self, resourceName: str, moduleName: str, callbackName: str, timeoutSeconds: int
    ) -> concurrent.futures.Future:
        """Waits for a resource, at most `timeoutSeconds`, as long as it takes if that is negative; then an error."""
        return self._acquire([resourceName], moduleName, callbackName, timeoutSeconds)

    @remote("v([s]ssi)")
    def acquireResourcesTree(
        self, resourceNameList: list[str], moduleName: str, callbackName: str, timeoutSeconds: int
    ) -> concurrent.futures.Future:
        """Waits for all of these resources; see acquireResource."""
        return self._acquire(resourceNameList, moduleName, callbackName, timeoutSeconds)

    @remote("v([s]s)")
    def releaseResources(self, resourceNames: list[str], ownerName: str) -> None:
        """Gives resources back; those that the module does not own stay as they are."""
        self._check(resourceNames)
        with self._lock:
            for name in resourceNames:
                if self._owners.get(name, ("", ""))[0] == ownerName:
                    del self._owners[name]

    @remote("v(ss)")
    def releaseResource(self, resourceName: str, ownerName: str) -> None:
        """Gives a resource back."""
        self.releaseResources([resourceName], ownerName)

    @remote("v(sssi)")
    def waitForResource(
        self, resourceName: str, ownerName: str, callbackName: str, timeoutSeconds: int
    ) -> concurrent.futures.Future:
        """Old name of acquireResource."""
        return self._acquire([resourceName], ownerName, callbackName, timeoutSeconds)

    @remote("v([s]ssi)")
    def waitForResourcesTree(
        self, pResourceNameList: list[str], pOwner: str, pLooseCallbackName: str, pnTimeOutMillisec: int
    ) -> concurrent.futures.Future:
        """Old form of acquireResourcesTree, with the time in milliseconds."""
        return self._acquire(pResourceNameList, pOwner, pLooseCallbackName, pnTimeOutMillisec / 1000)

    @remote("[s]([s]ssi[s])")
    def waitForOptionalResourcesTree(
        self,
        pResourceNameList: list[str],
        pOwner: str,
        pLooseCallbackName: str,
        pnTimeOutMillisec: int,
        pOptionalResourceNameList: list[str],
    ) -> concurrent.futures.Future:
        """Like waitForResourcesTree; takes the optional ones that are free then, too, and lists them."""
        self._check(pOptionalResourceNameList)
        return self._acquire(
            pResourceNameList, pOwner, pLooseCallbackName, pnTimeOutMillisec / 1000, pOptionalResourceNameList
        )

    # --- inside ------------------------------------------------------------------------------------------------------

    def _acquire(
        self, names: list[str], module: str, callback: str, seconds: float, optional: Iterable[str] = ()
    ) -> concurrent.futures.Future:
        self._check(names)
        if not module:
            raise ServiceError("moduleName must not be empty")
        done: concurrent.futures.Future = concurrent.futures.Future()
        if self._take(names, module, callback):
            done.set_result([name for name in optional if self._take([name], module, callback)])
            return done
        if seconds == 0:
            raise ServiceError(f"{', '.join(names)} cannot be had now")
        return self._workers.run(self._wait, names, module, callback, seconds, tuple(optional))

    def _wait(self, names: list[str], module: str, callback: str, seconds: float, optional: Iterable[str]) -> list[str]:
        """Ask the owners to release what is wanted, and take it when they have."""
        with self._lock:
            owners = {name: self._owners[name] for wanted in names for name in self._in_the_way(wanted, module)}
        for name, (owner, release) in owners.items():
            if release:
                self._clients.call(owner, release, name, owner)
        limit = _ENDLESS if seconds < 0 else seconds
        if not self._workers.wait_until(lambda: self._take(names, module, callback), limit):
            raise ServiceError(f"{', '.join(names)} could not be had within {limit:g} s")
        return [name for name in optional if self._take([name], module, callback)]

    def _take(self, names: list[str], module: str, callback: str) -> bool:
        """Lend all of these to a module; false if one is not free."""
        with self._lock:
            if any(self._in_the_way(name, module) or name in self._disabled for name in names):
                return False
            for name in names:
                self._owners[name] = (module, callback)
        return True

    def _in_the_way(self, name: str, module: str) -> list[str]:
        """Return what others own: a resource, those in it, and those that hold it."""
        around, above = [*self._inside(name)], self._parents.get(name, "")
        while above:
            around.append(above)
            above = self._parents.get(above, "")
        return [known for known in around if known in self._owners and self._owners[known][0] != module]

    def _inside(self, name: str) -> list[str]:
        """Return a resource and all that are in it."""
        found = [name]
        for inner in found:
            found += [child for child, parent in self._parents.items() if parent == inner]
        return found

    def _check(self, names: Iterable[str]) -> None:
        for name in names:
            if name not in self._parents:
                raise ServiceError(f"there is no resource {shown(name)}")
