"""The browser viewer: Meshcat's page, our own server."""

from warpsim.observers.viewer.controls import Command, Status
from warpsim.observers.viewer.pages import fresh_token
from warpsim.observers.viewer.viewer import Viewer

__all__ = ["Command", "Status", "Viewer", "fresh_token"]
