"""One percent: each formula changed by so much in a copy of the checkout, and the oracles that must turn red for it.

    python -m tests.verify.mutations                 the whole matrix, about a quarter of a minute for each change
    python -m tests.verify.mutations vortex kick     those changes only

`red` names for each scene the oracles that must FAIL; all others of it may do as they like, for a formula may serve many.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]


class Mutation(NamedTuple):
    """A change of one formula: `old` stands once in the file."""

    name: str
    file: str
    old: str
    new: str
    red: dict[str, str]
    """Scene -> oracles, separated by blanks."""


FLOW, VORTICES, FORCES, BIRTH = "kernels/flow.py", "kernels/vortices.py", "kernels/forces.py", "kernels/birth.py"
MUTATIONS = (
    Mutation("uniform", FLOW, "    return p.strength\n", "    return p.strength * 1.01\n",
             {"uniform": "wind streakline bits", "strengths": "all_four", "mesh_emitter": "draft"}),
    Mutation("source", FLOW, "p.strength[0] * INVERSE_TWO_PI / (wp.dot", "1.01 * p.strength[0] * INVERSE_TWO_PI / (wp.dot",
             {"source": "source sink driven", "sink_drain": "hole"}),
    Mutation("point_source", FLOW, "p.strength[0] * INVERSE_FOUR_PI", "1.01 * p.strength[0] * INVERSE_FOUR_PI",
             {"point_source": "rate shell", "campfire": "tip"}),
    Mutation("vortex", FLOW, "(g * p.strength[0]", "(1.01 * g * p.strength[0]",
             {"vortex": "ideal rankine lamb_oseen scully", "campfire": "swirl", "sink_drain": "swirl", "smoke_street": "street"}),
    Mutation("rankine", FLOW, "wp.min(1.0, r2 / core2)", "wp.min(1.0, r2 / (1.01 * core2))", {"vortex": "rankine"}),
    Mutation("lamb_oseen", FLOW, "q = r2 / core2", "q = r2 / (1.01 * core2)", {"vortex": "lamb_oseen"}),
    Mutation("scully", FLOW, "g = r2 / (r2 + core2)", "g = r2 / (r2 + 1.01 * core2)", {"vortex": "scully", "campfire": "swirl"}),
    Mutation("doublet", FLOW, "wp.dot(d, p.strength) / r2)) / r2", "wp.dot(d, p.strength) / r2)) * 1.01 / r2",
             {"doublet": "top stagnation over_the_top"}),
    Mutation("rotation", FLOW, "wp.cross(p.axis, x - p.center) * p.strength[0]", "wp.cross(p.axis, x - p.center) * 1.01 * p.strength[0]",
             {"rotation": "turned vane", "fountain": "pool"}),
    Mutation("vortex_segment", VORTICES, "wp.cross(p.axis, d) * (p.strength[0]", "wp.cross(p.axis, d) * (1.01 * p.strength[0]",
             {"vortex_segment": "downwash beyond_the_tip"}),
    Mutation("vortex_ring", VORTICES, "common = p.strength[0]", "common = 1.01 * p.strength[0]",
             {"vortex_ring": "jet ahead", "leapfrog": "through_both"}),
    Mutation("travel", "kernels/environment.py", "primitive.center + primitive.turn *", "primitive.center + 1.01 * primitive.turn *",
             {"vortex_ring": "self_induced"}),
    Mutation("curl_noise", "kernels/noise.py", "return v * (p.strength[0]", "return v * (1.01 * p.strength[0]",
             {"curl_noise": "here later", "tornado": "foot beside"}),
    Mutation("expression", FLOW, "wp.vec3(float(u), float(v), float(w))", "1.01 * wp.vec3(float(u), float(v), float(w))",
             {"expression": "at_first bent spin", "tornado": "foot beside"}),
    Mutation("grid", "kernels/grids.py", "p.strength[0] * inside)", "1.01 * p.strength[0] * inside)",
             {"grid": "left_of_center below ghia_1982"}),
    Mutation("images", "warpsim/images.py", "matrix(factor @", "matrix(1.01 * factor @",
             {"cylinder_flow": "stagnation above_rests", "magnus": "rest_below", "wall": "carried floor"}),
    Mutation("constant", FORCES, "g = 1.0 / wp.sqrt(s2)", "g = 1.01 / wp.sqrt(s2)", {"attractor": "circle rosette", "galaxy": "halo"}),
    Mutation("inverse_square", FORCES, "g = 1.0 / (s2", "g = 1.01 / (s2", {"attractor": "kepler", "galaxy": "core companion"}),
    Mutation("spring", FORCES, "g = float(1.0)", "g = float(1.01)",
             {"attractor": "swing", "solvers": "euler_gains verlet_turns rk4_turns"}),
    Mutation("pair_inverse_square", "kernels/pairwise.py", "return law.strength[0] / (s2 *", "return 1.01 * law.strength[0] / (s2 *",
             {"pairwise": "0", "cluster": "0"}),
    Mutation("separation", "kernels/flock.py", "company.apart * rules.separation", "company.apart * (1.01 * rules.separation)",
             {"flock": "course", "paths": "follower", "species": "shy", "school": "frightened", "starlings": "bits"}),
    Mutation("arrive", "kernels/steering.py", "wp.length(d) / b.radius)) - boid.v) * b.weight",
             "wp.length(d) / b.radius)) - boid.v) * (1.01 * b.weight)", {"river_fish": "trout"}),
    Mutation("path", "kernels/steering.py", "near + ahead - boid.x, b.speed) - boid.v) * b.weight",
             "near + ahead - boid.x, b.speed) - boid.v) * (1.01 * b.weight)", {"paths": "follower", "crowd": "walker"}),
    Mutation("vicsek", "kernels/flight_loops.py", "w[c] * speed", "w[c] * (1.01f * speed)", {"vicsek": "pace"}),
    Mutation("cohesion", "kernels/flock.py", "coherent * rules.cohesion", "coherent * (1.01 * rules.cohesion)", {"flock": "course"}),
    Mutation("alignment", "kernels/flock.py", "turn * rules.alignment", "turn * (1.01 * rules.alignment)", {"flock": "course"}),
    Mutation("stiffness", "kernels/springs.py", "n * (k * (d2", "n * (1.01 * k * (d2",
             {"springs": "swing weight decay", "jelly": "wobble", "curtain": "hem",
              "modes": "first second third fourth fifth",
              "oscillators": "euler semi_implicit_euler verlet rk4 abm_pece_4",
              "trampoline": "sag", "rope_bridge": "hangs gives_way", "flutter": "corner"}),
    Mutation("damping", "kernels/springs.py", "+ c * wp.dot(n, vj - vi)", "+ 1.01 * c * wp.dot(n, vj - vi)", {"springs": "decay"}),
    Mutation("rest_length", "kernels/springs.py", "(d2 * inverse - r)", "(d2 * inverse - 1.01 * r)",
             {"springs": "weight", "chain": "catenary"}),
    Mutation("implicit_stiffness", "kernels/implicit.py", "hhk = wp.min(h * h * k", "hhk = wp.min(1.01 * h * h * k",
             {"stiff": "bob", "oscillators": "implicit_euler"}),
    Mutation("implicit_damping", "kernels/implicit.py", "wp.min(h * c", "wp.min(1.01 * h * c", {"stiff": "bob"}),
    Mutation("compliance", "kernels/xpbd.py", "(kappa * (d2 *", "(1.01 * kappa * (d2 *", {"oscillators": "xpbd"}),
    Mutation("projection", "kernels/xpbd.py", "- multiplier) / (1.0 + kappa * w)", "- multiplier) / (1.0 + 1.01 * kappa * w)",
             {"ropes": "rubber hemp wire beyond"}),
    Mutation("response", "kernels/xpbd.py", "inverse_mass[i] * mean_decay(k * h)", "1.01 * inverse_mass[i] * mean_decay(k * h)",
             {"ropes": "rubber hemp"}),
    Mutation("bending", "kernels/bending.py", "m * (k + c *", "m * (1.01 * k + c *", {"bending": "paper card steel"}),
    Mutation("tearing", "warpsim/systems/parts/tearing.py", "wp.array([1.0 + system.spec.tear]", "wp.array([1.0 + 1.01 * system.spec.tear]",
             {"tear": "stone"}),
    Mutation("water", "kernels/facets.py", "s * (-c * into", "s * (-1.01 * c * into", {"fish": "still_there"}),
    Mutation("wave", "kernels/muscles.py", "wave = amplitude * sin64(", "wave = wp.float64(1.01) * amplitude * sin64(",
             {"fish": "still_there", "worm": "crawl", "breathing": "breath"}),
    Mutation("grip", "kernels/response.py", "* share + grip[2] * (1.0 - share)", "* share * 1.01 + grip[2] * (1.0 - share) * 1.01",
             {"grip": "down across"}),
    Mutation("muscle", "kernels/muscles.py", "+ a * (p - wp.float64(1.0) + wave)", "+ a * (p - wp.float64(1.0) + wave) * wp.float64(1.01)",
             {"muscles": "soft resonant stiff", "fish": "still_there"}),
    Mutation("follow", "kernels/exponential.py", "x + (n0 + n1 * real(0.5)", "x + (n0 + n1 * real(0.505)",
             {"integrators": "third fourth corrected"}),
    Mutation("gravity", "warpsim/environment.py", "wp.vec3(*self.scene.gravity)", "wp.vec3(*(1.01 * g for g in self.scene.gravity))",
             {"ballistic": "top throw", "coupling": "parabola stokes", "sink_drain": "jet", "snow": "flake",
              "fireworks": "rise", "rain": "fall", "tumble": "falls"}),
    Mutation("drag_rate", "kernels/environment.py", "viscosity) * inverse_mass", "viscosity) * inverse_mass * 1.01",
             {"coupling": "drag stokes", "campfire": "smoke spark", "fountain": "drop droplet", "snow": "flake caked",
              "hourglass": "fall"}),
    Mutation("stokes", "kernels/environment.py", "SIX_PI * radius", "1.01 * SIX_PI * radius", {"coupling": "stokes"}),
    Mutation("kick", "kernels/integration.py", "return h * mean_decay(k * h)", "return real(1.01) * h * mean_decay(k * h)",
             {"coupling": "parabola drag", "attractor": "circle"}),
    Mutation("drift", "kernels/integration.py", "return x + v * h\n", "return x + v * (real(1.01) * h)\n",
             {"uniform": "streakline", "coupling": "parabola tracer", "strengths": "keyframes sine", "integrators": "end late"}),
    Mutation("ballistic_position", "kernels/integration.py", "(0.5 * t)", "(0.505 * t)", {"ballistic": "top throw", "sink_drain": "jet"}),
    Mutation("restitution", "kernels/response.py", "- n * (c.restitution * wn)", "- n * (1.01 * c.restitution * wn)",
             {"colliders": "ground ball", "billiard": "kept"}),
    Mutation("friction", "kernels/response.py", "brake = c.friction *", "brake = 1.01 * c.friction *", {"colliders": "slide"}),
    Mutation("keyframes", "kernels/signals.py", "a[1] + (b[1] - a[1])", "a[1] + wp.float64(1.01) * (b[1] - a[1])",
             {"strengths": "keyframes"}),
    Mutation("sine", "kernels/signals.py", "s.mean + s.amplitude *", "s.mean + wp.float64(1.01) * s.amplitude *",
             {"strengths": "all_four sine", "rotation": "turned vane", "campfire": "tip swirl", "uniform": "wind streakline"}),
    Mutation("expression_sine", "kernels/expressions.py", "return sin64(x)\n", "return wp.float64(1.01) * sin64(x)\n",
             {"strengths": "all_four", "smoke_street": "street"}),
    Mutation("count", "kernels/emission.py", "mean = wp.max(sample_signal", "mean = wp.float64(1.01) * wp.max(sample_signal",
             {"count_laws": "constant_mean", "emitter_shapes": "births", "sink_drain": "foam"}),
    Mutation("lifetime", BIRTH, "wp.max(draw(emitter.lifetime", "wp.max(1.01 * draw(emitter.lifetime",
             {"emitter_shapes": "births", "sink_drain": "foam"}),
    Mutation("mass", BIRTH, "wp.max(draw(emitter.mass", "wp.max(1.01 * draw(emitter.mass", {"coupling": "drag stokes", "snow": "flake"}),
    Mutation("radius", BIRTH, "wp.max(draw(emitter.extent", "wp.max(1.01 * draw(emitter.extent", {"coupling": "stokes"}),
    Mutation("speed", BIRTH, "return d * draw(emitter.speed", "return d * 1.01 * draw(emitter.speed",
             {"ballistic": "top throw speed", "coupling": "parabola drag"}),
    Mutation("inherit", BIRTH, "read3(log.velocity, q) * emitter.share", "read3(log.velocity, q) * (1.01 * emitter.share)",
             {"events": "of_birth of_impact of_death"}),
    Mutation("moment_of_death", "kernels/events.py", "age_of(i, watch) - watch.particles.lifetime[i])",
             "1.01 * (age_of(i, watch) - watch.particles.lifetime[i]))", {"events": "of_death"}),
    Mutation("cone", BIRTH, "(1.0 - emitter.cone_cosine)", "1.01 * (1.0 - emitter.cone_cosine)", {"fountain": "cone"}),
    Mutation("segment", BIRTH, "emitter.half * uniform_signed", "emitter.half * 1.01 * uniform_signed", {"emitter_shapes": "segment"}),
    Mutation("disc", BIRTH, "r = emitter.radius *", "r = 1.01 * emitter.radius *", {"emitter_shapes": "disc"}),
    Mutation("sphere", BIRTH, "(emitter.radius * wp.max(largest", "(1.01 * emitter.radius * wp.max(largest", {"emitter_shapes": "ball"}),
    Mutation("box", BIRTH, "wp.cw_mul(h, wp.vec3(x, y, z))", "wp.cw_mul(h * 1.01, wp.vec3(x, y, z))", {"emitter_shapes": "box faces"}),
    Mutation("mesh_surface", BIRTH, "emitter.turn * on_surface(", "emitter.turn * 1.01 * on_surface(", {"mesh_emitter": "skin"}),
    Mutation("mesh_volume", BIRTH, "emitter.turn * in_volume(", "emitter.turn * 1.01 * in_volume(", {"mesh_emitter": "inside"}),
    Mutation("round", "kernels/clearance.py", "gap.g = length - c.radius", "gap.g = length - 1.01 * c.radius", {"drape": "top"}),
    Mutation("layers", "warpsim/systems/parts/self_collision.py", "= d, d / CORE, reach", "= 1.01 * d, d / CORE, reach",
             {"fold": "second_layer"}),
    Mutation("thickness", "warpsim/systems/lasting.py", "edge + (-thickness if row.inside else thickness)",
             "edge + 1.01 * (-thickness if row.inside else thickness)", {"tablecloth": "edges"}),
    Mutation("air", "kernels/cloth.py", "area * (g * wp.dot", "area * (1.01 * g * wp.dot",
             {"cloth": "drift", "flags": "corner", "flutter": "corner"}),
)  # fmt: skip


def mutated(mutation: Mutation, folder: Path) -> Path:
    """Return a copy of the checkout with the change."""
    top = folder / mutation.name
    for room in ("kernels", "warpsim", "scenes"):
        shutil.copytree(ROOT / room, top / room, ignore=shutil.ignore_patterns("__pycache__"))
    path = top / mutation.file
    text = path.read_text()
    assert text.count(mutation.old) == 1, (
        f"{mutation.name}: {mutation.old!r} must stand once in {mutation.file}, not {text.count(mutation.old)} times"
    )
    path.write_text(text.replace(mutation.old, mutation.new))
    return top


def verified(top: Path, scenes, cache: Path) -> tuple[int, dict[str, dict[str, str]]]:
    """Return exit code and verdicts, scene -> oracle -> verdict, of `verify` in a checkout, with a kernel cache of its own."""
    environment = {**os.environ, "PYTHONPATH": str(top), "WARP_CACHE_PATH": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    line = [sys.executable, "-m", "warpsim", "verify", *scenes, "--device", "cpu", "--threads", "1", "--json"]
    done = subprocess.run(line, cwd=top, env=environment, capture_output=True, text=True)
    assert done.stdout, done.stderr
    results = json.loads(done.stdout)
    return done.returncode, {result["scene"]: {oracle["name"]: oracle["verdict"] for oracle in result["oracles"]} for result in results}


def survivors(mutation: Mutation, folder: Path) -> list[str]:
    """Return the oracles that must turn red and do not."""
    code, verdicts = verified(mutated(mutation, folder), mutation.red, folder / "cache")
    shutil.rmtree(folder / mutation.name)
    wanted = [(scene, oracle) for scene, oracles in mutation.red.items() for oracle in oracles.split()]
    lasting = [
        f"{scene}.{oracle}: {verdicts[scene].get(oracle, 'no such oracle')}"
        for scene, oracle in wanted
        if verdicts[scene].get(oracle) != "fail"
    ]
    return lasting + ([] if code == 1 else [f"exit code {code}"])


def main() -> int:
    """Run the matrix, or what is named; exit status 1 if any oracle stays green."""
    chosen = [mutation for mutation in MUTATIONS if mutation.name in sys.argv[1:] or not sys.argv[1:]]
    green = 0
    with tempfile.TemporaryDirectory() as folder:
        for mutation in chosen:
            lasting = survivors(mutation, Path(folder))
            green += len(lasting)
            print(
                f"{mutation.name:<20} {'; '.join(lasting) or 'red: ' + ', '.join(f'{s} {o}' for s, o in mutation.red.items())}", flush=True
            )
    print(f"{len(chosen)} formulas changed by 1 %, {green} oracles that should have turned red and did not")
    return 1 if green else 0


if __name__ == "__main__":
    sys.exit(main())
