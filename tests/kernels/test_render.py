"""Packing for the viewer against the twin."""

import numpy as np

from tests.physics.scenes import emitter, simulate
from tests.reference import render as reference

LOOK = {
    "size": {"over_life": [[0, 0.1], [0.3, 0.4], [1, 0.0]]},
    "color": {"over_life": [[0, "#ff8000"], [0.5, "#00ff4080"], [1, "#0000ff00"]]},
}


def test_packed_points_equal_the_twin(device):
    """Steps may differ by one where a place falls on the border between two: float32 resolves 1e-7 of a box of 65536 steps, 1 %."""
    spec = {"mean": 1.0, "spread": 0.5}
    keys = {"shape": {"type": "sphere", "radius": 2.0}, "velocity": {"cone": 180, "speed": spec}, "lifetime": spec}
    sim = simulate(emitter(257, **keys), device=device, motion="ballistic", look=LOOK)
    sim.run(0.4)
    p, packed = sim.frame()["p"], sim.frame()["p"].packed()
    share = (np.arange(256) + 0.5) / 256
    size = np.interp(share, [0, 0.3, 1], [0.1, 0.4, 0.0])
    color = np.stack([np.interp(share, [0, 0.5, 1], c) for c in ([255, 0, 0], [128, 255, 0], [0, 64, 255], [255, 128, 0])], axis=1)
    place, rgba = reference.pack(p.position.astype(float), (p.age / p.lifetime).astype(float), size / size.max(), np.rint(color))
    assert packed.count == p.count == 257
    off = np.abs(packed.position.astype(int) - place.astype(int))
    assert off.max() <= 1 and (off > 0).mean() < 0.03
    assert (np.abs(packed.color.astype(int) - rgba) <= 1).all()


def test_a_flat_cloud_has_no_steps_across(device):
    sim = simulate(emitter(50, shape={"type": "disc", "radius": 1.0}), device=device, motion="ballistic")
    packed = sim.frame()["p"].packed()
    assert (packed.position[:, 1] == 0).all() and packed.scale[1] == 0.0 and np.ptp(packed.position[:, 0].astype(int)) == 65535
