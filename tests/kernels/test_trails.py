"""Trails against the twin: through births, deaths, compaction, and the frames before frame 0."""

import numpy as np
import pytest

from tests.physics.scenes import emitter, simulate
from tests.reference.trails import trail

LOOK = {"trail": {"duration": 0.1, "points": 4}}  # at 60 frames/s over 3 gaps: every second frame


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("prewarm", [0.0, 0.25])
def test_trails_equal_the_twin(native, prewarm, device):
    """Within a step of the box. Frames before 0 cannot be seen, but straight flight tells where everyone was."""
    keys = {"rate": 300.0, "velocity": {"cone": 180, "speed": 2.0}, "lifetime": {"mean": 0.15, "spread": 0.1}}
    sim = simulate(emitter(**keys), device=device, native=native, prewarm=prewarm, look=LOOK, substeps=1)
    for index in range(31):
        if index:
            sim.step_frame()
        p, packed = sim.frame()["p"], sim.frame()["p"].packed()
        if index % 5 or not p.count:
            continue
        got = packed.trail[:, :, :3] * packed.scale + packed.offset
        for row in range(p.count):
            lived = int(np.floor(p.age[row] * 60 + 1e-4))  # whole frames since the first that saw it
            place = {index - k: p.position[row] - p.velocity[row] * (k / 60) for k in range(lived + 1)}
            assert np.abs(got[row] - trail(place, index, 2, 4)).max() < 1.1 * packed.scale.max() + 2e-6, (index, row)


def test_a_limit_is_kept_whoever_is_left(device):
    """Of ids 1 and 3 none is a multiple of the stride 2; even so one is shown, and not everyone."""
    short, long = emitter(1, lifetime=0.01), emitter(1)
    sim = simulate(short, long, short, long, device=device, motion="ballistic")
    sim.run(0.1)
    assert sim.frame()["p"].id.tolist() == [1, 3] and sim.frame()["p"].packed(1).count == 1
