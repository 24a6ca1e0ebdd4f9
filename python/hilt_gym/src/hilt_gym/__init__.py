"""hilt's simulated tasks as Gymnasium environments, and policies over hilt's wire."""

from .client import PolicyClient
from .env import HiltEnv
from .process import HiltProcess
from .server import PolicyServer, serve_policy
from .wire import Refused, pack, unpack

__all__ = ["HiltEnv", "HiltProcess", "PolicyClient", "PolicyServer", "Refused", "pack", "serve_policy", "unpack"]
