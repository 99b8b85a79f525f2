"""Observers consume frames: they can never slow, stop or change a run."""
