"""Time of a scene: frames, substeps, duration."""

from pydantic import Field

from warpsim.scene.base import Number, Spec
from warpsim.scene.pacing import Substeps


class Time(Spec):
    """Frames and steps. Frame k is the state at t = k/fps."""

    fps: Number = Field(60.0, gt=0.0, le=1e6, description="Frames per second [1/s].")
    substeps: Substeps = Field(
        4, description="Steps per frame; auto: each particle as many as its tolerance asks for, a network as many as its springs need [1]."
    )
    duration: Number = Field(10.0, ge=0.0, le=1e7, description="Length of a run [s].")
    prewarm: Number = Field(0.0, ge=0.0, le=1e5, description="Time simulated before frame 0, so that it starts in full swing [s].")
