"""The camera a scene is first seen through."""

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Number, Spec, Vec3, mistakes


class Camera(Spec):
    """Where the viewer looks from and to; y is up."""

    eye: Vec3 = Field(description="Where the camera is [m].")
    target: Vec3 = Field((0.0, 0.0, 0.0), description="What it looks at [m].")
    field_of_view: Number = Field(45.0, ge=1.0, le=170.0, description="Full vertical angle of view [degrees].")

    @model_validator(mode="after")
    def _looks_somewhere(self):
        if self.eye == self.target:
            raise mistakes([Mistake(("target",), "is where the eye is; the camera must look somewhere", ("eye", "target"))])
        return self
