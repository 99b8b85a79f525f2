"""Scene texts for the tests: one that uses every key, and the shipped ones."""

from warpsim.scene import shipped_scenes

FOLDER = next(iter(shipped_scenes().values())).parent  # the files that shipped scenes name are under it

EVERYTHING = """\
# yaml-language-server: $schema=scene.schema.json
name: Everything
description: |
  Every key of the format,
  once.
seed: 7
time: {fps: 60, substeps: 4, duration: 8.0, prewarm: 0.5}
gravity: [0, -9.81, 0]
flow:
  - {type: uniform, velocity: [0.4, {sine: {amplitude: 0.1, period: 3}}, {expression: "0.1*sin(2*pi*t)"}]}
  - {name: spring, type: source, center: [0, 0, 0], axis: [0, 1, 0], rate: 0.8}
  - {type: point_source, center: &origin [0, 1, 0], rate: -0.5}
  - {name: swirl, type: vortex, center: [0, 0, 0], axis: [0, 1, 0],
     circulation: {keyframes: [[0, 0], [2, 3]]}, core: {model: lamb_oseen, radius: 0.1}}
  - type: doublet
    center: *origin
    axis: [0, 0, 1]
    direction: [1, 0, 0]
    strength: {sine: {mean: 1, amplitude: 0.5, period: 2.0, phase: 1.57}}
  - {type: rotation, center: [0, 0, 0], axis: [0, 1, 0], angular_velocity: 0.2, travel: [{expression: "0.2*t"}, 0, 0]}
  - {type: vortex_segment, start: [0, 0, -1], end: [0, 0, 1], circulation: 0.3, core: {radius: 0.05, model: scully}}
  - {type: vortex_ring, center: [0, 1, 0], normal: [0, 1, 0], radius: {keyframes: [[0, 0.5], [4, 0.7]]}, circulation: 0.4}
  - {type: curl_noise, amplitude: {keyframes: [[0, 0], [1, 0.5]]}, length: 0.8, frequency: 0.7, octaves: 3, seed: 11}
  - {type: expression, velocity: ["y*sin(t)", -x, 0]}
obstacles:
  - {name: mast, type: cylinder, center: [3, 0, 0], axis: [0, 1, 0], radius: 0.2, circulation: {sine: {amplitude: 0.7, period: 5}},
     answers: [0]}
  - {type: wall, center: [0, -9, 0], normal: [1, 0, 0], answers: false}
forces:
  - {name: sun, type: attractor, center: [0, 2, 0], strength: 1.5}
  - {type: attractor, center: [3, 2, 0], strength: 2, law: inverse_square, softening: 0.05}
  - {name: dust, type: pairwise, law: cosine, strength: {keyframes: [[0, 0], [1, -1e-3]]}, radius: 0.1, softening: 0.01}
colliders:
  - {name: ground, type: plane, center: [0, -1, 0], normal: [0, 1, 0.1], restitution: 0.3, friction: 0.4, action: bounce}
  - {center: [0, 1, 0], radius: 4, type: "sphere", side: inside, motion: {center: [0, {sine: {amplitude: 0.2, period: 2}}, 0]}}
  - {type: box, size: [0.2, 0.3, 0.4], rotation: [10, 20, 30], motion: {rotation: {keyframes: [[0, [0, 0, 0]], [2, [0, 90, 0]]]}}}
  - {type: capsule, start: [1, 1, 1], end: [1, 2, 1], radius: 0.1, action: kill, side: outside}
  - {type: mesh, file: meshes/knot.obj, center: [5, 0, 0], scale: 0.2, thickness: 0.01, action: stick}
systems:
  sparks:
    type: particles
    capacity: 2e5
    substeps: 8
    solver: verlet
    coupling: {alpha: 0.02}
    feels: {gravity: true, flow: [swirl, 0], forces: [sun], colliders: [ground, 1]}
    emitters:
      - name: bowl
        shape: {type: disc, center: [0, 0, 0], normal: [0, 1, 0], radius: 0.3, fill: surface}
        rate: {mean: 20000, spread: 5000, law: scaled_uniform, interval: 0.05}
        velocity: {direction: [0, 1, 0], cone: 20, speed: {mean: 2.0, spread: 0.5, law: normal}}
        lifetime: {mean: 2.0, spread: 0.5}
        mass: 1.0e-3
        radius: {mean: 1e-3, spread: 2e-4}
        start: 0.5
        stop: 6
      - shape: {type: segment, start: [0, 0, 0], end: [1, 0, 0]}
        burst: [{count: 100}, {count: 50, at: 2.5}]
      - shape: {type: box, center: [0, 0, 0], size: [1, 2, 3], fill: volume}
        rate: {keyframes: [[0, 0], [1, 300.5]]}
    look:
      as: sprites
      blend: additive
      size: {over_life: [[0, 0.01], [1, 0.05]]}
      color: {over_life: [[0, "#fff2a0"], [0.5, "#ff7a18"], [1, "#ff300000"]]}
  dust:
    type: particles
    coupling: tracer
    solver: rk4
    emitters: [{shape: {type: sphere, radius: 2}, rate: {expression: 100 + 50*sin(t)}}]
    look: {as: points, size: 0.005, color: [1, 0.5, 0.25]}
  stones:
    type: particles
    motion: ballistic
    feels: {forces: false, colliders: false}
    emitters: [{shape: {type: point}, burst: {count: 20}, lifetime: 9, color: ["#f80", [0.5, 0.6, 0.7]]}]
  fog:
    type: particles
    coupling: {viscosity: 1.8e-5}
    emitters:
      - on: {event: death, of: stones, inherit: {velocity: 0.5, color: true}}
        burst: {count: 3}
  web:
    type: springs
    generator: {type: grid, resolution: [5, 4], corner: [0, 1, 0], edges: [[1, 0, 0], [0, -0.5, 0.2]]}
    mass: 0.013
    stiffness: 40.5
    damping: 0.2
    rest_length: 0.21
    radius: 0.004
    pins: [corners, 2]
    pin_motion:
      - {pins: [2], keyframes: [[0, [0, 0, 0]], [1.5, [0, 0.2, 0.1]]]}
      - {pins: [corners], displacement: [{sine: {amplitude: 0.01, period: 4}}, 0, 0]}
    look: {show: [points, springs, surface], width: 0.003}
  sail:
    type: cloth
    resolution: [6, 4]
    corner: [0, 2, 0]
    edges: [[1, 0, 0], [0, -0.8, 0.1]]
    density: 0.21
    structural: {stiffness: 55, damping: 0.02}
    shear: {stiffness: 22}
    bend: {stiffness: 1, damping: 0.01}
    drag: 1e-4
    air: 0.4
    pins: [left, [5, 0]]
  bridge:
    type: springs
    points: [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]]
    springs: [[0, 1], [1, 2]]
    mass: [1, 0.5, 1]
    stiffness: [10, 20]
    pins: [0]
  eel:
    type: springs
    generator:
      type: body
      head: [1, 1, 0]
      tail: [0, 1, 0.1]
      up: [0, 1, 0.2]
      sections: [{at: 0}, {at: 0.3, width: 0.1, height: 0.2}, {at: 0.7, width: 0.1, height: 0.1}, {at: 1, height: 0.2}]
    stiffness: 50
    water: 3
    chains: {keel: [0, 3, 7]}
    muscles:
      - {chain: left_top, part: [0, 0.9], wave: {amplitude: [0.1, -0.2], period: 2, wavelength: 1.5, phase: 0.3}, activation: 0.5}
      - {chain: [keel, right_top], rest: {sine: {mean: 1, amplitude: 0.1, period: 1}}}
      - {springs: rings, wave: {amplitude: 0.1, period: 1, wavelength: 2, direction: [-1, 0, 0.5]}}
    grip: {chain: [left_bottom, keel], forward: 0.2, backward: 1.5, sideways: 0.9}
  birds:
    type: flock
    count: 120
    domain: {min: [-6, 0, -6], max: [6, 5, 6], boundary: contain}
    perception: {radius: 1.25, field_of_view: 290, nearest: 7}
    separation: {weight: 1.1, radius: 0.75}
    cohesion: 0.95
    alignment: {weight: 1.3}
    speed: [2, 3.5]
    max_force: 12
    turn_rate: 200
    attends: {hawks: {separation: {weight: 25}, alignment: -0.1, radius: 3.5, field_of_view: 360, nearest: 2}}
    steering:
      - {name: roost, type: seek, target: [0, {sine: {mean: 2, amplitude: 1, period: 9}}, 0], radius: 30, speed: 2.5}
      - {type: flee, target: {keyframes: [[0, [5, 1, 0]], [3, [-5, 1, 0]]]}, radius: 1.5, weight: 4}
      - {type: arrive, target: [1, 1, 1], radius: 0.6, weight: 0.1}
      - {type: pursue, target: [{expression: "3*cos(t)"}, 1, 0], horizon: 1.1, weight: 0.2}
      - {type: evade, target: [4, 4, 4], radius: 2.25, horizon: 0.4}
      - {type: wander, radius: 1.75, distance: 2.2, period: 0.65, weight: 0.3}
      - {type: path, points: [[-3, 1, 0], [3, 1, 0], [0, 3, 2]], closed: true, radius: 0.55, horizon: 0.35}
      - {type: leader, boid: 3, distance: 0.45, radius: 2.1}
      - {type: avoid, radius: 0.35, horizon: 0.8, weight: 9}
      - {type: contain, radius: 0.85, horizon: 0.25}
    mass: 0.08
    thickness: 0.03
    coupling: {"alpha": 0.005}
    start: {speed: 2.75, seed: 5}
    look: {as: birds, size: 0.15, color: {by: heading, range: [-180, 180], map: turbo}}
  hawks:
    type: flock
    count: 2
    substeps: 2
    domain: {min: [-6, 0, -6], max: [6, 5, 6]}
    perception: {radius: 5}
    look: {as: arrows}
  spins:
    type: flock
    count: 40
    domain: {min: [0, 0, 0], max: [5, 5, 0], boundary: periodic}
    perception: {radius: 1}
    vicsek: {speed: 0.3, noise: 1.5}
camera: {eye: [4, 2, 6], target: [0, 1, 0], field_of_view: 45}
verify:
  - {name: round, type: circulation, center: [0, 0, 0], axis: [0, 1, 0], radius: 0.5, at: 2, expect: 3, tolerance: 1e-5, reason: rounding}
  - {type: flux, center: [0, 0, 0], axis: [0, 1, 0], radius: 0.5, expect: 0.8, tolerance: {relative: 1e-4}}
  - {type: discharge, axis: [1, 0, 0], radius: 0.1, at: 1, expect: {expression: "0.4*pi*0.1^2 + 0*t"}, tolerance: 1}
  - {type: velocity, point: [9, 9, 9], expect: [0.4, {sine: {amplitude: 0.1, period: 3}}, 0], tolerance: 1}
  - {type: curl, point: [0.05, 0, 0], spacing: 0.01, expect: [0, 0, 0], tolerance: {absolute: 90}}
  - {type: divergence, point: [2, 0, 0], tolerance: 1e-3}
  - {type: streamline, start: [1, 0, 0], length: 2, steps: 100, plane: [2, 0, 0], normal: [1, 0, 0], expect: [2, 0, 0], tolerance: 1}
  - {name: settled, type: terminal_speed, system: sparks, emitter: bowl, at: 5.5, feels: {flow: [], forces: false}, tolerance: 1e-3}
  - {type: relaxation, system: sparks, velocity: [1, 0, 0], release: 0.5, at: 1, feels: {flow: false, forces: false}, tolerance: 1}
  - {type: arc, system: fog, start: [0, 1, 0], radius: 1e-3, at: 1, feels: {flow: false, forces: false}, tolerance: 1}
  - {type: orbit, system: stones, force: sun, turns: 2, expect: 3, tolerance: 1}
  - {type: position, of: system, system: stones, at: 1, expect: [0, -4.9, 0], tolerance: 1}
  - {type: energy, system: stones, at: 1, expect: 0, tolerance: 1}
  - {type: momentum, of: particle, system: stones, at: 1, tolerance: 1}
  - {type: live_count, system: sparks, emitter: bowl, at: 4, tolerance: {sigma: 4}}
  - {type: emission_mean, system: sparks, emitter: bowl, of: count, from: 1, to: 4, tolerance: {sigma: 4}}
  - {type: emission_variance, system: sparks, of: lifetime, to: 4, expect: 0, tolerance: 1e-6}
  - {type: uniformity, system: sparks, of: place, bins: 16, to: 4, tolerance: {sigma: 4}}
  - {type: convergence_order, system: sparks, solver: heun, tolerance: 0.15}
  - {type: place, system: web, point: 7, at: 1, expect: [0, 0, {expression: "0.5*t"}], tolerance: 9}
  - {type: period, system: bridge, point: 2, direction: [0, 1, 0], from: 0.5, to: 6, expect: 1, tolerance: {relative: 0.5}}
  - {type: order, systems: [spins], from: 1, to: 2, expect: 0.5, tolerance: 1}
  - {type: hash, at: 1, device: cpu, expect: 0123456789abcdef0123456789abcdef, reason: it would be another}
limits: {memory: 2.5, extent: 1e5, unstable: kill}
"""

SMALLEST = "name: smallest\n"


def sample_texts() -> dict[str, str]:
    """Return every sample by name, shipped scenes included."""
    shipped = {name: path.read_text(encoding="utf-8") for name, path in shipped_scenes().items()}
    return {"everything": EVERYTHING, "smallest": SMALLEST, **shipped}
