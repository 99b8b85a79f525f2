// The page's end of the websocket: Meshcat's commands go to Meshcat, ours and the frames are taken here, and each frame
// is acknowledged once it has been drawn, which is what asks for the next.  The layout of a frame is in protocol.py.
"use strict";

const FRAME_MARK = 0xc1;
const ARRAYS = {
  0x11: Int8Array, 0x12: Uint8Array, 0x13: Int16Array, 0x14: Uint16Array, 0x15: Int32Array, 0x16: Uint32Array, 0x17: Float32Array,
};
const NORMALIZED = 1, AFFINE = 2;

// Views over one frame: {number, time, slots: Map slot -> {position, color, sizeMax, live, ...}}.
function readFrame(buffer) {
  const data = new DataView(buffer), slots = new Map();
  let at = 16;
  for (let left = data.getUint16(2, true); left > 0; left--) {
    const slot = data.getUint16(at, true), attribute = data.getUint8(at + 2), width = data.getUint8(at + 4);
    const kind = ARRAYS[data.getUint8(at + 3)], flags = data.getUint8(at + 5), bytes = data.getUint32(at + 12, true);
    at += 16;
    let affine = [1, 1, 1, 0, 0, 0];
    if (flags & AFFINE) { affine = new Float32Array(buffer, at, 6); at += 24; }
    const view = new kind(buffer, at, bytes / kind.BYTES_PER_ELEMENT);
    at += (bytes + 7) & ~7;
    if (!slots.has(slot)) slots.set(slot, {});
    const parts = slots.get(slot);
    if (attribute === 0) parts.position = { view, width, affine };
    else if (attribute === 1) parts.color = { view, width };
    else if (attribute === 5) parts.poses = { view };
    else if (attribute === 6) parts.sizeMax = view[0];
    else if (attribute === 7) parts.live = view[0];
    else if (attribute === 8) parts.trail = { view, affine };
    else if (attribute === 9) parts.trailColor = { view };
    else if (attribute === 10) parts.trailPoints = view[0];
    else if (attribute === 11) parts.torn = view;
    else if (attribute === 12) parts.lost = view;
    else if (attribute === 13) parts.heading = { view, width };
  }
  return { number: data.getUint32(4, true), time: data.getFloat64(8, true), slots };
}

class Stream {
  constructor(viewer, stage, hud, controls) {
    this.viewer = viewer;
    this.stage = stage;
    this.hud = hud;
    this.controls = controls;
    this.lines = controls.lines;
    this.nets = controls.nets;
    this.solids = new Solids(stage);
    this.clouds = [];
    this.number = 0;          // of the frame shown last, on this connection
    this.time = 0;
    this.frames = 0;          // shown since the page was loaded
    this.unanswered = null;   // number of a frame shown but not yet drawn
    const command = viewer.handle_command.bind(viewer);
    viewer.handle_command = (c) => { this.command(c) || command(c); };
    const render = viewer.render.bind(viewer);
    viewer.render = () => { this.prepare(); render(); this.answer(); };
  }

  prepare() {
    const { camera } = this.viewer;
    this.stage.prepare();
    camera.updateMatrixWorld();
    for (const cloud of this.clouds) cloud.prepare(camera);
  }

  // Ours: the scene, its clouds, lines and sliders, and how the run is going.  Returns whether it was.
  command(c) {
    if (c.type === "warpsim_scene") {
      this.clouds = [];
      this.lines.clear();
      this.nets.clear();
      this.solids.clear();
      this.stage.set(c);
      this.hud.set(c);
      this.controls.set(c);
    } else if (c.type === "warpsim_controls") {
      this.controls.offer(c.controls);
    } else if (c.type === "warpsim_status") {
      this.hud.status(c);
      this.controls.status(c);
    } else if (c.type === "warpsim_lines") {
      this.lines.draw(c);
      this.controls.offerBoxes();
    } else if (c.type === "warpsim_solid") {
      this.solids.draw(c);
    } else if (c.type === "warpsim_cloud") {
      const cloud = this.clouds[c.slot] = new Cloud(c.name, c.shape, c.blend, this.stage.glow.on);
      this.viewer.set_object(c.path.split("/").filter((s) => s), cloud.points);
    } else if (c.type === "warpsim_net") {
      if (this.clouds[c.slot] !== undefined) {
        this.nets.join(c.slot, this.clouds[c.slot].join(c));
        this.controls.offerBoxes();
      }
    } else return false;
    this.viewer.set_dirty();
    return true;
  }

  show(frame) {
    frame.slots.forEach((parts, slot) => {
      parts.time = frame.time;
      if (parts.poses !== undefined) this.solids.place(parts.poses.view);
      else if (this.clouds[slot] !== undefined) this.clouds[slot].show(parts);
    });
    this.number = frame.number;
    this.time = frame.time;
    if (this.frames++ % 10 === 0) this.stage.follow(this.clouds);
    this.hud.frame(frame.time, this.clouds);
    this.controls.frame(frame.time);
    this.viewer.set_dirty();
  }

  answer() {
    if (this.unanswered === null || this.socket.readyState !== WebSocket.OPEN) return;
    this.socket.send(JSON.stringify({ type: "ack", frame: this.unanswered }));
    this.unanswered = null;
  }

  ask(command) {
    if (this.socket !== undefined && this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }

  receive(message) {
    if (new Uint8Array(message.data, 0, 1)[0] !== FRAME_MARK) {
      this.viewer.handle_command_message(message);
      return;
    }
    const frame = readFrame(message.data);
    this.show(frame);
    this.unanswered = frame.number;
  }

  // Meshcat's page never connects again; this one tries each second, so that it outlives the run and finds the next.
  connect() {
    const address = new URL("stream", location.href);
    address.search = location.search;   // the token, if there is one
    address.protocol = address.protocol.replace("http", "ws");
    this.viewer.connect(address.href);
    const socket = this.socket = this.viewer.connection;
    this.number = 0;
    this.unanswered = null;
    socket.onopen = () => {
      socket.send('{"type":"hello"}');
      this.hud.say("");
    };
    socket.onmessage = (message) => this.receive(message);
    socket.onclose = () => {
      this.hud.say("the run has ended; waiting for the next");
      this.controls.rest();
      setTimeout(() => this.connect(), 1000);
    };
  }
}
