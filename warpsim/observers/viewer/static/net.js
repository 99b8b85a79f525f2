// What joins the points of a network: its surface as a shaded sheet, seen from both sides, and its springs as round ribbons.
// Places come with the points; only the sheet's normals and the ribbons' ends are worked out here, into buffers that stay, and
// that are made when the part is first drawn.
"use strict";

class Net {
  // c: {springs, triangles: bytes of uint32, width, fine [m] of a spring by itself and on a surface, points, lines, surface: whether
  // the scene shows each}
  constructor(cloud, c) {
    const T = MeshCat.THREE, numbers = (bytes) => new Uint32Array(Uint8Array.from(bytes).buffer);
    this.cloud = cloud;
    this.whole = { springs: numbers(c.springs), triangles: numbers(c.triangles) };
    this.springs = this.whole.springs;       // those that are left of them
    this.triangles = this.whole.triangles;
    this.gone = { springs: new Uint8Array(0), triangles: new Uint8Array(0) };
    this.has = { points: true, springs: this.springs.length > 0, surface: this.triangles.length > 0 };
    this.own = { points: c.points, springs: c.lines, surface: c.surface };
    this.shown = this.own;
    this.widths = [c.width, c.fine];
    this.count = 0;
    const behind = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    const before = { polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 };  // ribbons of a surface lie on it
    this.sheet = new T.Mesh(new T.BufferGeometry(), Net.material(Net.SHEET_VERTEX, Net.SHEET, { eye: { value: new T.Vector3() } }, behind));
    this.ribbons = new T.Mesh(new T.InstancedBufferGeometry(), Net.material(Net.RIBBON_VERTEX, Net.RIBBON, {
      width: { value: c.width }, ink: { value: 0 }, viewSize: { value: new T.Vector2(1, 1) },
    }, before));
    const turn = new T.Matrix4();
    this.sheet.onBeforeRender = (renderer, scene, camera) => {
      turn.copy(this.sheet.matrixWorld).invert();
      this.sheet.material.uniforms.eye.value.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(turn);
    };
    this.ribbons.onBeforeRender = (renderer) => renderer.getDrawingBufferSize(this.ribbons.material.uniforms.viewSize.value);
    for (const mesh of [this.sheet, this.ribbons]) {
      mesh.frustumCulled = false;
      mesh.visible = false;
      mesh.renderOrder = -1;   // it hides what is behind, so it comes before all that is soft
      cloud.points.add(mesh);
    }
    this.draw(this.own);
  }

  // parts: {points, springs, surface}, whether each is to be drawn; on a surface springs are fine lines that stand out from it
  draw(parts) {
    const { material } = this.ribbons;
    this.shown = parts;
    this.cloud.points.material.visible = parts.points;
    const onSurface = this.drawn("surface");
    material.uniforms.width.value = this.widths[onSurface ? 1 : 0];
    material.uniforms.ink.value = onSurface ? 1 : 0;
    material.transparent = onSurface;
    material.depthWrite = !onSurface;
    if (this.cloud.last !== null) this.show(this.cloud.last);
  }

  drawn(part) {
    return this.shown[part] && this.has[part];
  }

  // position: {view: Uint16Array of four numbers a point, affine}, color: {view: four bytes a point}, torn, lost: a bit for each spring
  // and triangle that is no more, absent where nothing tears
  show({ position, color, torn, lost }) {
    const count = position.view.length / 4;
    if (count !== this.count) this.fit(count);
    const { view, affine } = position, place = this.place;
    for (let i = 0, p = 0, q = 0; i < count; i++, p += 4, q += 3) {
      for (let axis = 0; axis < 3; axis++) place[q + axis] = view[p + axis] / 65535 * affine[axis] + affine[3 + axis];
    }
    if (torn !== undefined) this.keep("springs", 2, torn, "ribbons");
    if (lost !== undefined) this.keep("triangles", 3, lost, "sheet");
    this.sheet.visible = this.drawn("surface");
    this.ribbons.visible = this.drawn("springs");
    if (this.sheet.visible) this.lay(color.view);
    if (this.ribbons.visible) this.stretch(color.view);
  }

  // Leave out what is gone of the springs or triangles, of `width` numbers each; the buffers that draw them are made anew.
  keep(part, width, bits, buffers) {
    const known = this.gone[part];
    if (known.length === bits.length && known.every((byte, k) => byte === bits[k])) return;
    this.gone[part] = bits.slice();
    this[part] = this.whole[part].filter((number, k) => {
      const n = Math.floor(k / width);
      return (bits[n >> 3] >> (n & 7) & 1) === 0;
    });
    this.fresh[buffers] = true;
  }

  fit(count) {
    this.count = count;
    this.place = new Float32Array(3 * count);
    this.fresh = { sheet: true, ribbons: true };
  }

  sheetGeometry() {
    const T = MeshCat.THREE, geometry = new T.BufferGeometry(), { count } = this;
    this.normal = new Float32Array(3 * count);
    geometry.setIndex(new T.BufferAttribute(this.triangles, 1));
    geometry.setAttribute("position", new T.BufferAttribute(this.place, 3).setUsage(T.DynamicDrawUsage));
    geometry.setAttribute("normal", new T.BufferAttribute(this.normal, 3).setUsage(T.DynamicDrawUsage));
    geometry.setAttribute("color", new T.BufferAttribute(new Uint8Array(4 * count), 4, true).setUsage(T.DynamicDrawUsage));
    return geometry;
  }

  // The buffers of a part, made when it is first drawn with so many points.
  renew(part, made) {
    if (!this.fresh[part]) return;
    this.fresh[part] = false;
    this[part].geometry.dispose();
    this[part].geometry = made();
  }

  // Normals weighted by area, which is what the cross products add up to.
  lay(tint) {
    this.renew("sheet", () => this.sheetGeometry());
    const { place: x, normal: n, triangles } = this, { attributes } = this.sheet.geometry;
    n.fill(0);
    for (let t = 0; t < triangles.length; t += 3) {
      const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
      const ux = x[b] - x[a], uy = x[b + 1] - x[a + 1], uz = x[b + 2] - x[a + 2];
      const vx = x[c] - x[a], vy = x[c + 1] - x[a + 1], vz = x[c + 2] - x[a + 2];
      const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
      for (const k of [a, b, c]) {
        n[k] += nx;
        n[k + 1] += ny;
        n[k + 2] += nz;
      }
    }
    attributes.color.array.set(tint);
    for (const name of ["position", "normal", "color"]) attributes[name].needsUpdate = true;
  }

  stretch(tint) {
    this.renew("ribbons", () => this.ribbonGeometry());
    const { place, springs } = this, { start, end, color } = this.ribbons.geometry.attributes;
    for (let s = 0, at = 0; s < springs.length; s += 2, at += 3) {
      const i = 3 * springs[s], j = 3 * springs[s + 1];
      for (let axis = 0; axis < 3; axis++) {
        start.array[at + axis] = place[i + axis];
        end.array[at + axis] = place[j + axis];
      }
      for (let part = 0; part < 4; part++) color.array[2 * s + part] = tint[4 * springs[s] + part];
    }
    start.needsUpdate = end.needsUpdate = color.needsUpdate = true;
  }

  ribbonGeometry() {
    const T = MeshCat.THREE, count = this.springs.length / 2, geometry = new T.InstancedBufferGeometry();
    const each = (array, width, whole) => new T.InstancedBufferAttribute(array, width, whole).setUsage(T.DynamicDrawUsage);
    geometry.setAttribute("corner", new T.BufferAttribute(new Float32Array([0, -1, 1, -1, 1, 1, 0, 1]), 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    geometry.setAttribute("start", each(new Float32Array(3 * count), 3, false));
    geometry.setAttribute("end", each(new Float32Array(3 * count), 3, false));
    geometry.setAttribute("color", each(new Uint8Array(4 * count), 4, true));
    geometry.instanceCount = count;
    return geometry;
  }

  static material(vertexShader, fragmentShader, uniforms, offset) {
    const T = MeshCat.THREE, { near, far, color } = Looks.air;
    const air = { hazeNear: near, hazeFar: far, hazeColor: color };
    const options = { uniforms: { ...uniforms, ...air }, side: T.DoubleSide, ...offset };
    const [vertex, fragment, glslVersion] = viewer.renderer.capabilities.isWebGL2 ? [Net.VERTEX_300, Net.FRAGMENT_300, T.GLSL3] : ["", Net.FRAGMENT_100];
    return new T.RawShaderMaterial({ vertexShader: vertex + vertexShader, fragmentShader: fragment + fragmentShader, glslVersion, ...options });
  }
}

// The slope of a face comes from derivatives, which the two versions of the language spell differently.
Net.VERTEX_300 = `
#define attribute in
    #define varying out`;
Net.FRAGMENT_300 = `
    precision highp float;
    #define varying in
    out vec4 drawn;
    #define gl_FragColor drawn`;
Net.FRAGMENT_100 = "#extension GL_OES_standard_derivatives : enable\n";

Net.HAZE = `
    uniform float hazeNear, hazeFar;
    uniform vec3 hazeColor;
    vec3 hazy(vec3 own, float depth) { return mix(own, hazeColor, 0.9 * smoothstep(hazeNear, hazeFar, depth)); }`;

Net.SHEET_VERTEX = `
    precision highp float;
    attribute vec3 position, normal;
    attribute vec4 color;
    uniform mat4 modelViewMatrix, projectionMatrix;
    varying vec3 place, upward, tint;
    varying float depth;
    void main() {
      gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
      place = position;
      upward = normal;
      tint = color.rgb;
      depth = gl_Position.w;
    }`;

// Light from the sky, the sun and, for a thin sheet, the sun shining through; the far side a little darker than the near one.
Net.SHEET = `
    precision highp float;
    varying vec3 place, upward, tint;
    varying float depth;
    uniform vec3 eye;
    ${Net.HAZE}
    void main() {
      vec3 toEye = normalize(eye - place), n = upward / max(length(upward), 1e-20), face = cross(dFdx(place), dFdy(place));
      face = dot(face, face) > 0.0 ? normalize(face) : n;
      face *= dot(face, n) < 0.0 ? -1.0 : 1.0;
      float side = dot(face, toEye) < 0.0 ? -1.0 : 1.0;
      n = side * normalize(mix(face, n, smoothstep(0.72, 0.86, dot(face, n))));  // an edge sharper than 40 degrees is a crease
      vec3 sun = normalize(vec3(-0.4, 0.8, 0.45));
      float facing = dot(n, sun);
      float lit = 0.34 + 0.22 * (0.5 + 0.5 * n.y) + 0.52 * max(facing, 0.0) + 0.16 * max(-facing, 0.0);
      float shine = 0.14 * pow(max(dot(n, normalize(sun + toEye)), 0.0), 24.0) * step(0.0, facing);
      gl_FragColor = vec4(hazy(min(tint * (side < 0.0 ? 0.86 : 1.0) * lit + shine, 1.0), depth), 1.0);
    }`;

Net.RIBBON_VERTEX = `
    precision highp float;
    attribute vec2 corner;        // 0 or 1 along the spring, -1 or 1 across it
    attribute vec3 start, end;
    attribute vec4 color;
    uniform mat4 modelViewMatrix, projectionMatrix;
    uniform vec2 viewSize;        // [pixels]
    uniform float width;          // [m]
    varying vec3 tint;
    varying float side, depth, cover;
    void main() {
      vec4 from = projectionMatrix * (modelViewMatrix * vec4(start, 1.0));
      vec4 to = projectionMatrix * (modelViewMatrix * vec4(end, 1.0));
      vec4 at = corner.x < 0.5 ? from : to;
      vec2 run = (to.xy / to.w - from.xy / from.w) * viewSize;
      float pixels = max(width * projectionMatrix[1][1] * 0.5 * viewSize.y / at.w, 1.2);
      at.xy += vec2(-run.y, run.x) / max(length(run), 1e-6) * corner.y * pixels / viewSize * at.w;
      side = corner.y;
      depth = at.w;
      cover = clamp(0.5 * length(run) / (14.0 * pixels), 0.15, 1.0);  // where springs are short on the screen they are many
      tint = color.rgb;
      gl_Position = from.w <= 0.0 || to.w <= 0.0 ? vec4(2.0, 2.0, 2.0, 1.0) : at;
    }`;

Net.RIBBON = `
    precision highp float;
    varying vec3 tint;
    varying float side, depth, cover;
    uniform float ink;            // 1 on a surface: darker than it where it is bright, brighter where it is dark
    ${Net.HAZE}
    void main() {
      float round = sqrt(max(1.0 - side * side, 0.0)), bright = step(0.25, dot(tint, vec3(0.299, 0.587, 0.114)));
      vec3 own = tint * (0.45 + 0.5 * round - 0.12 * side), line = mix(0.5 + 0.5 * tint, 0.16 * tint, bright);
      gl_FragColor = vec4(hazy(mix(own, line, ink), depth), mix(1.0, cover, ink));
    }`;
