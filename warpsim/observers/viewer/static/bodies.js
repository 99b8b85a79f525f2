// Bodies that point where they go: arrows, birds and fish, one instance of a small shape for each.  A shape looks along +x, up is +y;
// its length is 1.  The vertex shader turns it along its heading, rolls it, and lets wings beat and tails swing.
"use strict";

class Bodies {
  constructor(kind, blend, inFloats) {
    const T = MeshCat.THREE;
    this.kind = Bodies.KINDS[kind];
    this.capacity = 0;
    this.fresh = false;
    this.mesh = new T.Mesh(new T.InstancedBufferGeometry(), Looks.body(this.kind, blend, inFloats));
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
    this.mesh.onBeforeRender = (renderer) => {
      this.fresh = false;
      this.mesh.material.uniforms.viewHeight.value = renderer.getDrawingBufferSize(Bodies.drawn).y;
    };
  }

  // parts: {position: {view: Uint16Array of four numbers a body, affine}, color: {view: four bytes a body}, heading: {view: Int8Array of
  // four numbers a body}, sizeMax [m], time [s]}
  show(parts) {
    const { position, color, heading } = parts;
    this.mesh.visible = heading !== undefined && heading.view.length > 0;
    if (!this.mesh.visible) return;
    const count = heading.view.length / 4, { uniforms } = this.mesh.material;
    if (count > this.capacity) this.grow(Math.ceil(1.5 * count));
    this.lay("place", position.view);
    this.lay("color", color.view);
    this.lay("heading", heading.view);
    this.mesh.geometry.instanceCount = count;
    uniforms.extent.value.fromArray(position.affine, 0);
    uniforms.origin.value.fromArray(position.affine, 3);
    if (parts.sizeMax !== undefined) uniforms.sizeMax.value = parts.sizeMax;
    uniforms.time.value = parts.time;
  }

  lay(name, view) {
    const attribute = this.mesh.geometry.attributes[name];
    if (this.fresh) attribute.array.set(view);
    else attribute.array = view;
    attribute.needsUpdate = true;
  }

  grow(capacity) {
    const T = MeshCat.THREE, geometry = new T.InstancedBufferGeometry(), { corners, normals, bends } = this.kind.shape();
    geometry.setAttribute("position", new T.BufferAttribute(new Float32Array(corners), 3));
    geometry.setAttribute("normal", new T.BufferAttribute(new Float32Array(normals), 3));
    geometry.setAttribute("bend", new T.BufferAttribute(new Float32Array(bends), 1));
    const each = { place: Uint16Array, color: Uint8Array, heading: Int8Array };
    for (const [name, kind] of Object.entries(each)) {
      geometry.setAttribute(name, new T.InstancedBufferAttribute(new kind(4 * capacity), 4, true).setUsage(T.DynamicDrawUsage));
    }
    // Where in its beat each one is at time 0: multiples of the golden ratio lie evenly, and neighbors far apart.
    const phase = Float32Array.from({ length: capacity }, (_, n) => (0.6180339887 * n) % 1);
    geometry.setAttribute("phase", new T.InstancedBufferAttribute(phase, 1));
    this.mesh.geometry.dispose();
    this.mesh.geometry = geometry;
    this.capacity = capacity;
    this.fresh = true;
  }

  // Triangles of points [x, y, z, bend] as flat arrays; a triangle has one normal, its own or that of a rounded body.
  static solid(triangles) {
    const corners = [], normals = [], bends = [];
    for (const triangle of triangles) {
      const [a, b, c] = triangle, u = b.map((x, k) => x - a[k]), v = c.map((x, k) => x - a[k]);
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const length = Math.hypot(...n) || 1;
      for (const [x, y, z, bend] of triangle) {
        corners.push(x, y, z);
        normals.push(n[0] / length, n[1] / length, n[2] / length);
        bends.push(bend || 0);
      }
    }
    return { corners, normals, bends };
  }

  // A spindle of elliptic rings along x: [[x, half height, half width, bend], …], pointed at both ends.
  static spindle(rings, sides) {
    const at = ([x, h, w, bend], k) => {
      const angle = (2 * Math.PI * k) / sides;
      return [x, h * Math.cos(angle), w * Math.sin(angle), bend];
    };
    const triangles = [];
    for (let r = 0; r + 1 < rings.length; r++) {
      for (let k = 0; k < sides; k++) {
        const a = at(rings[r], k), b = at(rings[r], k + 1), c = at(rings[r + 1], k + 1), d = at(rings[r + 1], k);
        triangles.push([a, b, c], [a, c, d]);
      }
    }
    return triangles;
  }

  static arrow() {
    const tip = [0.5, 0, 0], back = [-0.22, 0, 0], left = [-0.5, 0, -0.27], right = [-0.5, 0, 0.27], top = [-0.3, 0.13, 0], low = [-0.3, -0.13, 0];
    return Bodies.solid([[tip, top, left], [tip, right, top], [tip, left, low], [tip, low, right], [back, left, top], [back, top, right],
      [back, low, left], [back, right, low]]);
  }

  // Wings beat: their bend is the distance from the body.
  static bird() {
    const body = Bodies.spindle([[0.5, 0, 0, 0], [0.3, 0.055, 0.05, 0], [0.0, 0.075, 0.07, 0], [-0.28, 0.035, 0.035, 0], [-0.34, 0.0, 0.0, 0]], 6);
    const wing = (side) => {
      const root = [0.22, 0.03, 0.05 * side, 0], trailing = [-0.14, 0.03, 0.05 * side, 0];
      const elbow = [0.26, 0.03, 0.42 * side, 0.42], elbowBack = [-0.06, 0.03, 0.42 * side, 0.42], tip = [-0.04, 0.03, 0.95 * side, 0.95];
      return [[root, elbow, elbowBack], [root, elbowBack, trailing], [elbow, tip, elbowBack]];
    };
    const tail = [[[-0.26, 0.01, 0], [-0.56, 0.01, -0.12], [-0.56, 0.01, 0.12]]];
    return Bodies.solid([...body, ...wing(-1), ...wing(1), ...tail]);
  }

  // The tail swings: its bend is the distance behind the head, in lengths.
  static fish() {
    const bend = (x) => 0.5 - x, ring = (x, h, w) => [x, h, w, bend(x)];
    const body = Bodies.spindle([ring(0.5, 0, 0), ring(0.36, 0.075, 0.045), ring(0.16, 0.125, 0.065), ring(-0.1, 0.095, 0.045),
      ring(-0.32, 0.03, 0.015), ring(-0.36, 0.0, 0.0)], 8);
    const p = (x, y) => [x, y, 0, bend(x)];
    const fins = [[p(-0.3, 0), p(-0.52, 0.15), p(-0.42, 0)], [p(-0.3, 0), p(-0.42, 0), p(-0.52, -0.15)],
      [p(0.18, 0.11), p(-0.02, 0.19), p(-0.1, 0.09)], [p(0.05, -0.11), p(-0.1, -0.17), p(-0.12, -0.08)]];
    return Bodies.solid([...body, ...fins]);
  }
}

Bodies.drawn = new MeshCat.THREE.Vector2();
// beat: per second; swing: amplitude in lengths, of wings up and down, of tails aside
Bodies.KINDS = {
  arrows: { shape: Bodies.arrow, beat: 0, swing: [0, 0], roll: 1 },
  birds: { shape: Bodies.bird, beat: 4.5, swing: [0.42, 0], roll: 1 },
  fish: { shape: Bodies.fish, beat: 2.2, swing: [0, 0.16], roll: 0.3 },
};
