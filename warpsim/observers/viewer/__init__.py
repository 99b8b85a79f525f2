"""The browser viewer: Meshcat's page, our own server."""

from warpsim.observers.viewer.viewer import Viewer

__all__ = ["Viewer"]
