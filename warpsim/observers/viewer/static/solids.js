// Colliders: solid shapes in a quiet matte, containers and zones that kill as glass.  Where each is comes with every frame.
"use strict";

class Solids {
  constructor(stage) {
    this.stage = stage;
    this.drawn = new Map();     // place -> mesh
  }

  clear() {
    this.drawn.clear();
  }

  draw(command) {
    const T = MeshCat.THREE, { scene, viewer } = this.stage, path = [...scene.root.split("/").filter((s) => s), `solid ${command.place}`];
    const group = new T.Group(), reach = this.stage.reach();
    const geometry = Solids.geometry(command, reach), plane = command.shape === "plane";
    if (command.glass && !plane) {
      // The far wall behind the particles, the near one before them.
      const pane = command.shape === "box" ? "pane" : "glass";
      group.add(Solids.mesh(geometry, Solids.material(scene.sky, pane, T.BackSide, reach), -1));
      group.add(Solids.mesh(geometry, Solids.material(scene.sky, pane, T.FrontSide, reach), 3));
      if (pane === "pane") group.add(Solids.edges(geometry, scene.sky));
    } else {
      group.add(Solids.mesh(geometry, Solids.material(scene.sky, plane ? "plane" : "matte", T.DoubleSide, reach), plane ? -1 : 0));
    }
    viewer.set_object(path, group);
    this.drawn.set(command.place, group);
  }

  // poses: seven numbers per collider, its center and the quaternion of its rotation
  place(poses) {
    this.drawn.forEach((group, k) => {
      if (7 * k + 7 > poses.length) return;
      group.position.fromArray(poses, 7 * k);
      group.quaternion.fromArray(poses, 7 * k + 3);
    });
  }

  static mesh(geometry, material, order) {
    const mesh = new MeshCat.THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    mesh.renderOrder = order;
    return mesh;
  }

  static geometry({ shape, radius, axis, size, middle, vertices, triangles, smooth }, reach) {
    const T = MeshCat.THREE, up = new T.Vector3(0, 1, 0);
    const along = axis === undefined ? up : new T.Vector3().fromArray(axis);
    const turn = new T.Quaternion().setFromUnitVectors(up, along.clone().normalize());
    if (shape === "sphere") return new T.SphereGeometry(radius, 64, 40);
    if (shape === "box") return new T.BoxGeometry(...size).translate(...(middle || [0, 0, 0]));
    if (shape === "plane") return new T.CircleGeometry(12 * reach, 96).rotateX(-Math.PI / 2).applyQuaternion(turn);
    if (shape === "capsule") {
      const profile = [], half = along.length();
      for (let k = 0; k <= 32; k++) {
        const angle = Math.PI * (k / 32 - 0.5), side = k < 16 ? -half : half;
        if (k === 16) profile.push(new T.Vector2(radius, -half));
        profile.push(new T.Vector2(Math.max(radius * Math.cos(angle), 1e-6 * radius), side + radius * Math.sin(angle)));
      }
      return new T.LatheGeometry(profile, 64).applyQuaternion(turn);
    }
    const geometry = new T.BufferGeometry();
    geometry.setAttribute("position", new T.BufferAttribute(new Float32Array(Uint8Array.from(vertices).buffer), 3));
    geometry.setIndex(new T.BufferAttribute(new Uint32Array(Uint8Array.from(triangles).buffer), 1));
    const ready = smooth ? geometry : geometry.toNonIndexed();
    ready.computeVertexNormals();
    return ready;
  }

  static edges(geometry, sky) {
    const T = MeshCat.THREE, color = new T.Color().fromArray(Solids.RIM[sky]);
    const lines = new T.LineSegments(new T.EdgesGeometry(geometry), new T.LineBasicMaterial({ color, transparent: true, opacity: 0.6 }));
    lines.frustumCulled = false;
    return lines;
  }

  static material(sky, look, side, reach) {
    const T = MeshCat.THREE, solid = look === "matte";
    const uniforms = { color: { value: Solids.COLOR[sky] }, rim: { value: Solids.RIM[sky] }, reach: { value: 12 * reach } };
    return new T.ShaderMaterial({
      uniforms, side, transparent: !solid, depthWrite: solid, vertexShader: Solids.VERTEX, fragmentShader: Solids.LOOKS[look],
    });
  }
}

Solids.COLOR = { night: [0.17, 0.20, 0.26], dusk: [0.44, 0.50, 0.58], day: [0.80, 0.78, 0.74] };
Solids.RIM = { night: [0.38, 0.47, 0.62], dusk: [0.86, 0.91, 0.97], day: [0.42, 0.47, 0.53] };
Solids.VERTEX = `
  varying vec3 facing, toward, own;
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    facing = normalMatrix * normal;
    toward = -seen.xyz;
    own = position;
    gl_Position = projectionMatrix * seen;
  }`;
Solids.HEAD = `
  uniform vec3 color, rim;
  uniform float reach;
  varying vec3 facing, toward, own;
  vec3 sun() { return normalize((viewMatrix * vec4(-0.45, 0.6, 0.75, 0.0)).xyz); }  // Meshcat's world has z up`;
Solids.LOOKS = {
  matte: `${Solids.HEAD}
    void main() {
      vec3 n = normalize(facing), eye = normalize(toward);
      if (dot(n, eye) < 0.0) n = -n;
      vec3 up = normalize((viewMatrix * vec4(0.0, 0.0, 1.0, 0.0)).xyz);
      float wrap = max(0.5 + 0.5 * dot(n, sun()), 0.0);
      float light = 0.42 + 0.62 * wrap * wrap + 0.10 * dot(n, up);
      float edge = pow(1.0 - max(dot(n, eye), 0.0), 4.0);
      gl_FragColor = vec4(mix(color * light, rim, 0.35 * edge), 1.0);
    }`,
  glass: `${Solids.HEAD}
    void main() {
      vec3 n = normalize(facing), eye = normalize(toward);
      float across = abs(dot(n, eye));
      float edge = pow(1.0 - across, 2.5);
      float shine = pow(max(dot(reflect(-sun(), n * sign(dot(n, eye))), eye), 0.0), 60.0);
      float cover = 0.05 + 0.5 * edge + 0.25 * shine;
      gl_FragColor = vec4(rim + 0.4 * shine, cover);
    }`,
  pane: `${Solids.HEAD}
    void main() {
      float across = abs(dot(normalize(facing), normalize(toward)));
      gl_FragColor = vec4(rim, 0.04 + 0.10 * (1.0 - across));
    }`,
  plane: `${Solids.HEAD}
    void main() {
      float fade = max(1.0 - length(own) / reach, 0.0);
      gl_FragColor = vec4(mix(color, rim, 0.15), 0.55 * fade * fade);
    }`,
};
