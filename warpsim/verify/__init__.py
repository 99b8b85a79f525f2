"""Verification: measures what a scene states about itself, and compares it with theory worked out apart from the kernels."""

from warpsim.verify.examination import verify_scene
from warpsim.verify.findings import Finding

__all__ = ["Finding", "verify_scene"]
