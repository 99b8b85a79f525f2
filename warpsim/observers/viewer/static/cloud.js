// One system's points.  Frames are laid into its buffers in place: no copy on the page, no new buffer while it fits.
"use strict";

class Cloud {
  constructor(name, shape, blend, inFloats) {
    const T = MeshCat.THREE;
    this.name = name;
    this.count = 0;      // points drawn
    this.live = 0;       // particles alive
    this.capacity = 0;   // points that the buffers hold
    this.fresh = false;  // buffers of this capacity are not yet on the graphics card
    this.turn = new T.Matrix4();
    this.bodies = Bodies.KINDS[shape] === undefined ? null : new Bodies(shape, blend, inFloats);
    this.points = new T.Points(new T.BufferGeometry(), Looks.material(shape, blend, inFloats));
    this.points.name = name;
    this.points.frustumCulled = false;              // its bounding sphere would be of some past frame
    this.points.renderOrder = blend === "additive" ? 1 : 0;
    // Soft ones that cover one another are drawn from far to near; light adds up in any order, and spheres keep their depth.
    this.order = shape === "sprites" && blend !== "additive" ? new DepthOrder() : null;
    this.trail = new Trail(blend, inFloats);
    this.points.add(this.trail.mesh);
    if (this.bodies !== null) {
      this.points.material.visible = false;
      this.points.add(this.bodies.mesh);
    }
    this.net = this.last = null;
    const drawn = new T.Vector2();
    this.points.onBeforeRender = (renderer) => {
      this.fresh = false;
      this.points.material.uniforms.viewHeight.value = renderer.getDrawingBufferSize(drawn).y;
    };
  }

  // parts: {position: {view, width, affine}, color: {view, width}, sizeMax, live, trail, trailColor, trailPoints, torn, lost, heading}, views of
  // the message; time [s] is the frame's
  show(parts) {
    const { position, color } = parts, uniforms = this.points.material.uniforms;
    if (position === undefined || color === undefined) return;
    const count = position.view.length / position.width;
    if (count > this.capacity) this.grow(Math.ceil(count * 1.5), position, color);
    this.lay("position", position);
    this.lay("color", color);
    this.points.geometry.setDrawRange(0, count);
    uniforms.extent.value.fromArray(position.affine, 0);
    uniforms.origin.value.fromArray(position.affine, 3);
    if (parts.sizeMax !== undefined) uniforms.sizeMax.value = parts.sizeMax;
    this.count = count;
    this.live = parts.live === undefined ? count : parts.live;
    const { trail, trailColor, trailPoints } = parts;
    if (this.bodies !== null) this.bodies.show(parts, this.live);
    if (trail !== undefined) this.trail.show(trail, trailColor, trailPoints, 0.4 * uniforms.sizeMax.value);
    else this.trail.mesh.visible = false;
    this.last = parts;
    if (this.net !== null) this.net.show(parts);
  }

  // What joins its points; comes once, maybe after the first frame.
  join(c) {
    if (this.net !== null) this.points.remove(this.net.sheet, this.net.ribbons);
    this.net = new Net(this, c);
    return this.net;
  }

  // Before each picture.
  prepare(camera) {
    if (this.order === null || this.count === 0) return;
    const { geometry, material } = this.points, { extent } = material.uniforms, index = geometry.index;
    this.points.updateWorldMatrix(true, false);
    const e = this.turn.multiplyMatrices(camera.matrixWorldInverse, this.points.matrixWorld).elements;
    const toward = [e[2] * extent.value.x, e[6] * extent.value.y, e[10] * extent.value.z];
    if (!this.order.sort(geometry.attributes.position.array, this.count, toward, index.array)) return;
    if (!this.fresh) index.updateRange = { offset: 0, count: this.count };
    index.needsUpdate = true;
  }

  lay(name, part) {
    const attribute = this.points.geometry.attributes[name];
    if (attribute === undefined) return;
    if (this.fresh) attribute.array.set(part.view);   // the first upload sets the size, so it must be the whole array
    else if (part.view.length > 0) attribute.array = part.view;
    attribute.needsUpdate = true;
  }

  // The graphics buffers keep the size they were made with, so a larger cloud gets new ones, and the old are given back.
  grow(capacity, ...parts) {
    const T = MeshCat.THREE, geometry = new T.BufferGeometry();
    ["position", "color"].forEach((name, i) => {
      const { view, width } = parts[i];
      const attribute = new T.BufferAttribute(new view.constructor(capacity * width), width, true);
      geometry.setAttribute(name, attribute.setUsage(T.DynamicDrawUsage));
    });
    if (this.order !== null) geometry.setIndex(new T.BufferAttribute(new Uint32Array(capacity), 1).setUsage(T.DynamicDrawUsage));
    this.points.geometry.dispose();
    this.points.geometry = geometry;
    this.capacity = capacity;
    this.fresh = true;
  }

  // Where the cloud is: the box that holds most of it, so that a few strays do not count.  Null while it is empty.
  box() {
    const T = MeshCat.THREE, attribute = this.points.geometry.attributes.position;
    if (this.count === 0) return null;
    const { extent, origin } = this.points.material.uniforms, box = new T.Box3();
    const step = Math.max(1, Math.floor(this.count / 1000));
    for (const axis of [0, 1, 2]) {
      const sample = [];
      for (let i = 0; i < this.count; i += step) sample.push(attribute.array[4 * i + axis] / 65535);
      sample.sort((a, b) => a - b);
      const at = (share) => sample[Math.round(share * (sample.length - 1))];
      const place = (value) => value * extent.value.getComponent(axis) + origin.value.getComponent(axis);
      box.min.setComponent(axis, place(at(0.02)));
      box.max.setComponent(axis, place(at(0.98)));
    }
    return box;
  }
}
