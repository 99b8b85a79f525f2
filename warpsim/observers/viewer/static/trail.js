// A fading ribbon behind each particle: one instance of a small rectangle per piece, always as wide as seen from the eye.
// The pieces overlap in one buffer: a piece reaches from point n to point n + 1, and from the last point of one trail to the
// first of the next nothing is drawn.
"use strict";

class Trail {
  constructor(blend, inFloats) {
    const T = MeshCat.THREE;
    this.pieces = 0;
    this.capacity = 0;     // points that the buffers hold
    this.points = 0;       // of each trail
    this.fresh = false;
    this.mesh = new T.Mesh(new T.InstancedBufferGeometry(), Looks.trail(blend, inFloats));
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
    this.mesh.renderOrder = blend === "additive" ? 1 : 0;
    this.mesh.onBeforeRender = (renderer) => {
      this.fresh = false;
      renderer.getDrawingBufferSize(this.mesh.material.uniforms.viewSize.value);
    };
  }

  // places: {view: Uint16Array, affine}, four numbers to a point; color: {view: Uint8Array}, one to a trail; width [m]
  show(places, color, points, width) {
    const count = places.view.length / 4, { uniforms } = this.mesh.material;
    this.pieces = Math.max(count - 1, 0);
    this.mesh.visible = this.pieces > 0;
    if (!this.mesh.visible) return;
    if (count > this.capacity || points !== this.points) this.grow(Math.ceil(1.5 * count), points);
    const { start, color: tint } = this.mesh.geometry.attributes;
    this.lay(start.data, places.view);
    this.lay(tint, color.view);
    this.mesh.geometry.instanceCount = this.pieces;
    uniforms.extent.value.fromArray(places.affine, 0);
    uniforms.origin.value.fromArray(places.affine, 3);
    uniforms.width.value = width;
  }

  lay(buffer, view) {
    if (this.fresh) buffer.array.set(view);
    else buffer.array = view;
    buffer.needsUpdate = true;
  }

  grow(capacity, points) {
    const T = MeshCat.THREE, geometry = new T.InstancedBufferGeometry(), trails = Math.ceil(capacity / points);
    const places = new T.InstancedInterleavedBuffer(new Uint16Array(4 * trails * points), 4, 1);
    places.setUsage(T.DynamicDrawUsage);
    geometry.setAttribute("corner", new T.BufferAttribute(new Float32Array([0, -1, 1, -1, 1, 1, 0, 1]), 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    geometry.setAttribute("start", new T.InterleavedBufferAttribute(places, 3, 0, true));
    geometry.setAttribute("end", new T.InterleavedBufferAttribute(places, 3, 4, true));
    const along = Float32Array.from({ length: trails * points }, (_, n) => (n % points === points - 1 ? -1 : (n % points) / (points - 1)));
    geometry.setAttribute("along", new T.InstancedBufferAttribute(along, 1));
    geometry.setAttribute("color", new T.InstancedBufferAttribute(new Uint8Array(4 * trails), 4, true, points).setUsage(T.DynamicDrawUsage));
    this.mesh.geometry.dispose();
    this.mesh.geometry = geometry;
    this.mesh.material.uniforms.step.value = 1 / (points - 1);
    this.capacity = trails * points;
    this.points = points;
    this.fresh = true;
  }
}
