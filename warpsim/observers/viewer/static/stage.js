// Camera and ground.  The scene may place the camera; else it is kept on the cloud until the viewer takes hold of it.
"use strict";

class Stage {
  constructor(viewer, glow) {
    this.viewer = viewer;
    this.glow = glow;
    this.touched = false;      // the person has moved the camera: it is theirs
    this.placed = false;       // the scene has placed it
    this.box = null;           // everything seen so far, while nobody has placed the camera
    this.wanted = null;        // {target, distance} the camera glides to
    this.scene = null;
    this.spacing = 0;
  }

  // The commands of a scene arrive again whenever the connection does: the camera stays where the person put it.
  set(scene) {
    const again = this.scene !== null && this.scene.name === scene.name;
    this.scene = scene;
    this.spacing = 0;
    this.glow.on = this.glow.possible && scene.sky === "night";
    Looks.air.color.value.fromArray(scene.haze);
    if (again) return;
    this.touched = false;
    this.box = this.wanted = null;
    this.placed = scene.camera !== null;
    this.viewer.controls.addEventListener("start", () => { this.touched = true; });
    if (this.placed) this.look(scene.camera.eye, scene.camera.target, scene.camera.field_of_view);
    else this.look([2.2, 1.6, 4], [0, 0.6, 0], 45);
  }

  look(eye, target, fieldOfView) {
    const { camera, controls } = this.viewer;
    camera.fov = fieldOfView;
    camera.position.fromArray(eye);
    controls.target.fromArray(target);
    controls.update();
  }

  // A length that suits the scene [m].
  reach() {
    const { camera } = this.scene;
    return camera === null ? 2 : 0.5 * Math.hypot(...camera.eye.map((x, k) => x - camera.target[k]));
  }

  // Called with the clouds now and then: the camera follows a cloud that grows, and never shrinks back.
  follow(clouds) {
    if (this.placed || this.touched) return;
    const T = MeshCat.THREE, box = this.box === null ? new T.Box3() : this.box.clone();
    for (const cloud of clouds) {
      const part = cloud.box();
      if (part !== null) box.union(part);
    }
    if (box.isEmpty() || (this.box !== null && this.box.containsBox(box))) return;
    const first = this.box === null, { camera } = this.viewer;
    // A little more than there is now, so that a growing cloud does not move the camera all the time.
    const radius = Math.max(0.5 * box.getSize(new T.Vector3()).length(), 0.05) * 1.15;
    const half = Math.atan(Math.tan(camera.fov * Math.PI / 360) * Math.min(camera.aspect, 1));
    this.box = box;
    this.wanted = { target: box.getCenter(new T.Vector3()), distance: radius / Math.sin(half) };
    if (first) this.glide(1);
  }

  glide(share) {
    if (this.wanted === null || this.touched) return;
    const T = MeshCat.THREE, { camera, controls } = this.viewer;
    const from = new T.Vector3().subVectors(camera.position, controls.target);
    const distance = from.length() + share * (this.wanted.distance - from.length());
    controls.target.lerp(this.wanted.target, share);
    camera.position.copy(from.setLength(distance).add(controls.target));
  }

  // Before each picture.  Meshcat's far plane is at 100 m; ours follows the distance, and so does the ground.
  prepare() {
    this.glide(0.06);
    const { camera, controls } = this.viewer, distance = camera.position.distanceTo(controls.target);
    camera.near = distance * 0.005;
    camera.far = distance * 200;
    Looks.air.near.value = 4 * distance;
    Looks.air.far.value = 40 * distance;
    if (this.scene !== null) this.ground(distance, controls.target);
  }

  // A faint grid at y = 0 in a round number of metres, fading out; none for a scene far above or below it, nor seen from its
  // edge, where all its lines would add up to one.
  ground(distance, target) {
    const spacing = Math.pow(10, Math.round(Math.log10(distance) - 0.9));
    const height = Math.abs(this.viewer.camera.position.y) / distance;
    const shown = this.scene.ground && Math.abs(target.y) < 1.5 * distance && height > 0.02;
    if (spacing !== this.spacing) {
      this.spacing = spacing;
      this.grid = Stage.grid(spacing, this.scene.sky);
      this.viewer.set_object([...this.scene.root.split("/").filter((s) => s), "ground"], this.grid);
    }
    this.grid.visible = shown;
    this.grid.material.opacity = this.grid.children[0].material.opacity = Math.min(1, 4 * (height - 0.02));
    const snap = (x) => Math.round(x / spacing) * spacing;
    this.grid.position.set(snap(target.x), 0, snap(target.z));
  }

  static grid(spacing, sky) {
    const T = MeshCat.THREE, reach = 30, place = [], color = [];
    const [r, g, b, a] = { night: [0.55, 0.62, 0.75, 0.16], dusk: [0.85, 0.90, 1.0, 0.16], day: [0.25, 0.32, 0.42, 0.22] }[sky];
    const add = (x, z) => {
      const fade = Math.max(0, 1 - Math.hypot(x, z) / reach);
      place.push(x * spacing, 0, z * spacing);
      color.push(r, g, b, a * fade * fade);
    };
    for (let line = -reach; line <= reach; line++) {
      for (let step = -reach; step < reach; step++) {
        if (Math.hypot(line, step) > reach) continue;
        add(line, step); add(line, step + 1);
        add(step, line); add(step + 1, line);
      }
    }
    const geometry = new T.BufferGeometry();
    geometry.setAttribute("position", new T.Float32BufferAttribute(place, 3));
    geometry.setAttribute("color", new T.Float32BufferAttribute(color, 4));
    const material = new T.LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false });
    const grid = new T.LineSegments(geometry, material);
    grid.frustumCulled = false;
    grid.renderOrder = -1;
    grid.add(Stage.soil(reach * spacing, sky));
    return grid;
  }

  // A breath of color under the grid, so that the ground is not the sky.
  static soil(reach, sky) {
    const T = MeshCat.THREE, geometry = new T.CircleGeometry(reach, 64).rotateX(-Math.PI / 2), color = [];
    const [r, g, b, a] = { night: [0.10, 0.11, 0.15, 0.5], dusk: [0.62, 0.68, 0.76, 0.28], day: [0.62, 0.60, 0.56, 0.32] }[sky];
    for (let n = 0; n < geometry.attributes.position.count; n++) color.push(r, g, b, n === 0 ? a : 0);
    geometry.setAttribute("color", new T.Float32BufferAttribute(color, 4));
    const soil = new T.Mesh(geometry, new T.MeshBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false, side: T.DoubleSide }));
    soil.frustumCulled = false;
    soil.renderOrder = -2;
    return soil;
  }
}
