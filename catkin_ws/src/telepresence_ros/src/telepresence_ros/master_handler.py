"""Debian's rosmaster, which forgets nodes that were killed.

Who is killed cannot sign off. rosmaster lists it for ever, and each time that a publisher of one of its topics comes or
goes tries to tell it, and writes a traceback. Robots' stations run for months, and every viewer that was killed would
stay.
"""

from __future__ import annotations

import http.client
import logging
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any
from urllib.parse import urlsplit

import rosmaster.master_api
from rosmaster.registrations import NodeRef, Registrations
from rosmaster.util import remove_server_proxy

log = logging.getLogger("rosmaster.master")


class MasterHandler(rosmaster.master_api.ROSMasterHandler):
    """The Master, Parameter Server and Slave APIs.

    Args:
        hosts: Names and addresses of this machine, at which its nodes are. One of them whose port is closed has ended;
            another machine's firewall may refuse the master and let its nodes come here all the same.
    """

    def __init__(self, hosts: Iterable[str]) -> None:
        super().__init__()
        self._hosts = {*hosts}

    def _notify(
        self, registrations: Registrations, task: Callable, key: str, value: Any, node_apis: Iterable[str]
    ) -> None:
        super()._notify(registrations, partial(self._notify_node, task), key, value, node_apis)

    def _notify_node(self, task: Callable, api: str, key: str, value: Any) -> None:
        """Notify one node; see `_notify`."""
        try:
            task(api, key, value)
        except (OSError, http.client.HTTPException) as error:
            remove_server_proxy(api)
            if isinstance(error, ConnectionRefusedError) and urlsplit(api).hostname in self._hosts:
                self._forget(api)
            else:
                log.warning("%s was not told of %s: %s", api, key, error)

    def param_update_task(self, caller_id: str, caller_api: str, param_key: str, param_value: Any) -> None:
        """Tell a node of a parameter's new value."""
        self._notify_node(partial(super().param_update_task, caller_id), caller_api, param_key, param_value)

    def _forget(self, api: str) -> None:
        """Take the node at `api` off all lists, and tell who has subscribed to what it published."""
        with self.ps_lock:
            nodes: dict[str, NodeRef] = self.reg_manager.nodes
            ended = {name: node for name, node in nodes.items() if node.api == api}
            for name in ended:
                del nodes[name]
                for registrations in (self.publishers, self.subscribers, self.services, self.param_subscribers):
                    registrations.unregister_all(name)
            for name, node in ended.items():
                log.info("%s at %s has ended without signing off: forgotten", name, api)
                for topic in node.topic_publications:
                    publishers, subscribers = self.publishers.get_apis(topic), self.subscribers.get_apis(topic)
                    self._notify_topic_subscribers(topic, publishers, subscribers)
