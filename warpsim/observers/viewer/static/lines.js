// Lines that come once and stay: streamlines of the flow, and faint drawings of emitters, flow primitives, obstacles and forces.
"use strict";

class Lines {
  constructor(stage) {
    this.stage = stage;
    this.drawn = new Map();     // key -> LineSegments
    this.hidden = new Map();    // key -> whether the person has hidden it, or not
  }

  clear() {
    this.drawn.clear();
  }

  // places: numbers, or float32 as bytes; `points` of them make a line
  draw({ key, points, places, shown }) {
    const T = MeshCat.THREE, { scene, viewer } = this.stage;
    const path = [...scene.root.split("/").filter((s) => s), `lines ${key}`];
    const flat = Array.isArray(places) ? Float32Array.from(places) : new Float32Array(Uint8Array.from(places).buffer);
    const lines = new T.LineSegments(Lines.geometry(flat, points, key), Lines.material(key, scene.sky));
    const hidden = this.hidden.get(key);
    lines.frustumCulled = false;
    lines.visible = hidden === undefined ? shown : !hidden;
    viewer.set_object(path, lines);
    this.drawn.set(key, lines);
  }

  toggle(key) {
    const lines = this.drawn.get(key);
    lines.visible = !lines.visible;
    this.hidden.set(key, !lines.visible);
    this.stage.viewer.set_dirty();
  }

  // Polylines as pairs of ends; a streamline grows brighter downstream, so that its sense is seen.
  static geometry(flat, points, key) {
    const T = MeshCat.THREE, count = Math.floor(flat.length / (3 * points)), pieces = count * (points - 1);
    const place = new Float32Array(6 * pieces), color = new Float32Array(8 * pieces);
    const grows = key === "streamlines";
    let at = 0, tint = 0;
    for (let line = 0; line < count; line++) {
      for (let n = 0; n < points - 1; n++) {
        for (const end of [n, n + 1]) {
          const from = 3 * (line * points + end), share = end / (points - 1);
          place.set(flat.subarray(from, from + 3), at);
          color.set([1, 1, 1, grows ? share * (1 - 0.9 * share ** 12) : 1], tint);
          at += 3;
          tint += 4;
        }
      }
    }
    const geometry = new T.BufferGeometry();
    geometry.setAttribute("position", new T.BufferAttribute(place, 3));
    geometry.setAttribute("color", new T.BufferAttribute(color, 4));
    return geometry;
  }

  static material(key, sky) {
    const bright = { emitters: 0xffc27a, flow: 0x7fd0ff, obstacles: 0xc9d2da, forces: 0xff8fb0, streamlines: 0x8fb8e8 };
    const dark = { emitters: 0xa35a00, flow: 0x0a5f96, obstacles: 0x4a5560, forces: 0x9c1f4c, streamlines: 0x34618f };
    const color = (sky === "day" ? dark : bright)[key] || 0x888888, opacity = key === "streamlines" ? 0.5 : 0.4;
    return new MeshCat.THREE.LineBasicMaterial({ color, vertexColors: true, transparent: true, opacity, depthWrite: false });
  }
}
