// Plays a recording: takes the place of start.js and of the run in an HTML file, where the frames are text after the page.
// Each frame is unpacked shortly before it is shown and forgotten soon after, so a long recording needs little memory.
"use strict";

const AHEAD = 8;

class Player {
  constructor(stream, controls) {
    this.stream = stream;
    this.controls = controls;
    this.fps = Number(document.getElementById("bar").dataset.fps);
    this.texts = [...document.querySelectorAll("script.frame")];
    this.times = this.texts.map((text) => Number(text.dataset.time));
    this.moments = this.measure();
    this.ready = new Map();      // number -> its bytes, or null while they are unpacked
    this.playing = true;
    this.speed = 1;
    this.clock = 0;              // [s] since the first frame
    this.shown = -1;
    this.count = 0;              // frames shown since the page was opened
    this.last = performance.now();
  }

  // When each frame is due [s].  A person may have paused, gone back or started anew while it was recorded: such a jump takes one frame.
  measure() {
    let at = 0;
    return this.times.map((time, k) => {
      const gap = k === 0 ? 0 : time - this.times[k - 1];
      return (at += k === 0 ? 0 : gap > 0 && gap < 12 / this.fps ? gap : 1 / this.fps);
    });
  }

  async start() {
    for (const block of document.querySelectorAll("script.commands")) await this.command(block.textContent);
    this.controls.offer([]);         // nobody answers to sliders
    this.controls.parts.record.hidden = true;
    this.controls.frame = () => {};  // the seek bar counts the frames of the recording
    this.tell();
    this.tick();
  }

  async command(text) {
    const buffer = await Player.unpack(text), data = new DataView(buffer);
    for (let at = 0; at < buffer.byteLength;) {
      const length = data.getUint32(at, true);
      this.stream.viewer.handle_command_message({ data: buffer.slice(at + 4, at + 4 + length) });
      at += 4 + length;
    }
  }

  // Base64 and gzip, taken back.
  static async unpack(text) {
    const letters = atob(text), bytes = new Uint8Array(letters.length);
    for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
    const gzip = new DecompressionStream("gzip"), writer = gzip.writable.getWriter();  // a Blob would go by another process
    writer.write(bytes);
    writer.close();
    return new Response(gzip.readable).arrayBuffer();
  }

  fetch(number) {
    if (number >= this.texts.length || this.ready.has(number)) return;
    this.ready.set(number, null);
    Player.unpack(this.texts[number].textContent).then((buffer) => { if (this.ready.has(number)) this.ready.set(number, buffer); });
  }

  tick() {
    requestAnimationFrame(() => this.tick());
    const now = performance.now(), end = this.moments[this.moments.length - 1];
    // Frames that are not unpacked yet are waited for, not skipped: the clock stands.
    if (this.playing && this.shown === this.due()) this.clock += Math.min(now - this.last, 250) / 1000 * this.speed;
    this.last = now;
    if (this.playing && this.clock > end) {
      this.clock = end;
      this.playing = false;
      this.tell();
    }
    const due = this.due();
    for (const number of this.ready.keys()) if (number < due || number > due + AHEAD) this.ready.delete(number);
    for (let number = due; number <= due + AHEAD; number++) this.fetch(number);
    const buffer = this.ready.get(due);
    if (due === this.shown || !buffer) return;
    this.shown = due;
    this.count++;
    this.stream.show(readFrame(buffer));
    this.tell();
  }

  // The last frame whose moment has come.
  due() {
    let low = 0, high = this.moments.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.moments[middle] <= this.clock + 1e-6) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  seek(number) {
    this.clock = this.moments[Math.min(Math.max(number, 0), this.moments.length - 1)] || 0;
  }

  ask(command) {
    const { type, value } = command, atEnd = this.due() === this.texts.length - 1;
    if (type === "play" && atEnd) this.seek(0);
    if (type === "play" || type === "pause") this.playing = type === "play";
    else if (type === "reset") this.seek(0);
    else if (type === "seek") this.seek(value);
    else if (type === "speed") this.speed = value;
    else if (type === "step") {
      this.playing = false;
      this.seek(this.due() + 1);
    }
    this.tell();
  }

  tell() {
    const place = { playing: this.playing, speed: this.speed, index: this.due(), frame_count: this.texts.length - 1 };
    const status = { ...place, values: {}, steps_per_second: 0, real_time_factor: 0, recording: false, note: "" };
    this.controls.status(status);
    this.stream.hud.status(status);
  }
}

var viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
var glow = new Glow(viewer);
var stage = new Stage(viewer, glow);
var controls = new Controls(viewer, new Lines(stage), new Nets(), (command) => player.ask(command));
var stream = new Stream(viewer, stage, new Hud(document.getElementById("hud")), controls);
var player;

document.addEventListener("DOMContentLoaded", () => {
  player = new Player(stream, controls);
  if (typeof DecompressionStream === "undefined") stream.hud.say("this browser is too old to play a recording");
  else if (player.texts.length === 0) stream.hud.say("an empty recording");
  else player.start();
});
