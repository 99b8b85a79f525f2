"""The browser viewer: Meshcat's page, our own server (docs: viewer)."""

from warpsim.observers.viewer.viewer import Viewer

__all__ = ["Viewer"]
