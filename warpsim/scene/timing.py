"""Time of a scene: frames, substeps, duration."""

from pydantic import Field

from warpsim.scene.base import Number, Spec, WholeNumber


class Time(Spec):
    """Frames and steps. Frame k is the state at t = k/fps."""

    fps: Number = Field(60.0, gt=0.0, le=1e6, description="Frames per second [1/s].")
    substeps: WholeNumber = Field(4, ge=1, le=10_000, description="Steps per frame [1].")
    duration: Number = Field(10.0, ge=0.0, le=1e7, description="Length of a run [s].")
    prewarm: Number = Field(0.0, ge=0.0, le=1e5, description="Time simulated before frame 0, so that it starts in full swing [s].")
