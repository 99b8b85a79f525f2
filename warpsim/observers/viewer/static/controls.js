// Buttons, keys and sliders.  What the person does goes out as a command; what is shown comes back with the status of the run,
// so that every page shows the same.  Names are set as text; a slider goes by its number.
"use strict";

const HOLD = 400;     // ms for which a slider in somebody's hand does not listen to the run

class Controls {
  constructor(viewer, lines, nets, send) {
    this.viewer = viewer;
    this.lines = lines;
    this.nets = nets;
    this.send = send;
    this.parts = Object.fromEntries(
      ["bar", "panel", "reset", "play", "step", "seek", "clock", "speed", "record", "image"].map((id) => [id, document.getElementById(id)]));
    this.sliders = [];
    this.state = null;         // the last status
    this.fps = 60;
    this.index = 0;
    this.held = new Map();     // input -> until when it is in somebody's hand
    this.waiting = new Map();  // what goes out with the next picture, by subject
    const { reset, play, step, seek, speed, record, image } = this.parts;
    const click = (button, act) => button.addEventListener("click", () => { act(); button.blur(); });
    click(reset, () => this.send({ type: "reset" }));
    click(play, () => this.toggle());
    click(step, () => this.send({ type: "step" }));
    click(record, () => this.send({ type: "record" }));
    click(image, () => this.save());
    seek.addEventListener("input", () => this.soon(seek, { type: "seek", value: Number(seek.value) }));
    speed.addEventListener("change", () => { this.send({ type: "speed", value: Number(speed.value) }); speed.blur(); });
    document.addEventListener("keydown", (event) => this.key(event));
    this.glyph();
  }

  set(scene) {
    this.fps = scene.fps;
    this.name = scene.name;
  }

  // A slider per number that the scene offers; nothing of it is shown until the run says that it listens.
  offer(controls) {
    const { panel } = this.parts;
    panel.textContent = "";
    this.sliders = controls.map((control, number) => {
      const label = document.createElement("label"), line = document.createElement("div"), word = document.createElement("span");
      const value = document.createElement("span"), input = document.createElement("input");
      line.className = "line";
      word.className = "word";
      word.textContent = control.label;
      word.title = control.path;
      Object.assign(input, { type: "range", min: control.min, max: control.max, step: "any", disabled: true });
      input.value = control.value === null ? control.min : control.value;
      input.addEventListener("input", () => {
        value.textContent = Controls.number(Number(input.value));
        this.soon(input, { type: "set", control: number, value: Number(input.value) });
      });
      value.textContent = control.value === null ? "varies" : Controls.number(control.value);
      line.append(word, value);
      label.append(line, input);
      panel.append(label);
      return { control, input, value };
    });
    panel.append(document.createElement("div"));
    this.offerBoxes();
  }

  // What can be drawn or not, each with a box to tick: parts of networks, and faint lines of the scene.
  offerBoxes() {
    const { panel } = this.parts, room = panel.lastElementChild, nets = Object.entries(this.nets.state());
    if (room === null) return;
    room.textContent = "";
    for (const [part, drawn] of nets) {
      const title = part === "springs" ? "Springs of networks (S)" : `${part} of networks`;
      room.append(Controls.box(part, title, drawn === "all", drawn === "some", () => this.toggleNets(part)));
    }
    for (const [key, lines] of this.lines.drawn) room.append(Controls.box(key, "", lines.visible, false, () => this.lines.toggle(key)));
    panel.hidden = this.sliders.length === 0 && this.lines.drawn.size === 0 && nets.length === 0;
  }

  static box(word, title, checked, indeterminate, act) {
    const label = document.createElement("label"), input = document.createElement("input");
    label.className = "check";
    label.title = title;
    Object.assign(input, { type: "checkbox", checked, indeterminate });
    input.addEventListener("change", () => { act(); input.blur(); });
    label.append(input, document.createTextNode(word));
    return label;
  }

  toggleNets(part) {
    this.nets.toggle(part);
    this.viewer.set_dirty();
    this.offerBoxes();
  }

  status(status) {
    const { bar, seek, speed, record } = this.parts;
    this.state = status;
    bar.hidden = false;
    seek.max = Math.max(status.frame_count, status.index);
    record.classList.toggle("on", status.recording);
    this.place(status.index);
    if (document.activeElement !== speed) {
      const near = [...speed.options].find((option) => Math.abs(Number(option.value) - status.speed) < 1e-6);
      if (near !== undefined) speed.value = near.value;
    }
    for (const { control, input, value } of this.sliders) {
      const told = status.values[control.path];
      input.disabled = false;
      if (told === undefined || this.inHand(input)) continue;
      input.value = told;
      value.textContent = Controls.number(told);
    }
    this.glyph();
  }

  // The run is gone, and with it whoever listens.
  rest() {
    this.parts.bar.hidden = true;
    this.state = null;
    for (const { input } of this.sliders) input.disabled = true;
  }

  frame(time) {
    if (this.state !== null && this.state.playing) this.place(Math.round(time * this.fps));
  }

  place(index) {
    const { seek, clock } = this.parts;
    this.index = index;
    if (!this.inHand(seek)) seek.value = index;
    clock.textContent = `${(index / this.fps).toFixed(2)} s · ${index}`;
  }

  toggle() {
    if (this.state === null) return;
    this.send({ type: this.state.playing ? "pause" : "play" });
  }

  glyph() {
    const playing = this.state !== null && this.state.playing, { play } = this.parts;
    play.querySelector(".go").style.display = playing ? "none" : "";
    play.querySelector(".halt").style.display = playing ? "" : "none";
  }

  // Of a slider's hundred places a second only the last before each picture goes out.
  soon(input, command) {
    this.held.set(input, performance.now() + HOLD);
    if (this.waiting.size === 0) {
      requestAnimationFrame(() => {
        const commands = [...this.waiting.values()];
        this.waiting.clear();
        commands.forEach(this.send);
      });
    }
    this.waiting.set(input, command);
    // What the run said meanwhile counts once the slider is let go.
    setTimeout(() => { if (this.state !== null && !this.inHand(input)) this.status(this.state); }, HOLD + 50);
  }

  inHand(input) {
    return (this.held.get(input) || 0) > performance.now();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
    const inSlider = event.target.tagName === "INPUT" && /^Arrow|^Home|^End/.test(event.key);
    const second = Math.round(this.fps);
    const acts = {
      " ": () => this.toggle(),
      ".": () => this.send({ type: "step" }),
      r: () => this.send({ type: "reset" }),
      ArrowLeft: () => this.send({ type: "seek", value: Math.max(this.index - second, 0) }),
      ArrowRight: () => this.send({ type: "seek", value: this.index + second }),
      i: () => this.save(),
      h: () => document.body.classList.toggle("bare"),
      s: () => this.toggleNets("springs"),
      t: () => document.body.classList.toggle("tree"),
    };
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (act === undefined || inSlider) return;
    event.preventDefault();
    if (this.state !== null || /^[ihst]$/i.test(event.key)) act();
  }

  // The picture as it stands, without the words.
  save() {
    this.viewer.render();
    this.viewer.renderer.domElement.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${this.name || "warpsim"} ${(this.index / this.fps).toFixed(2)} s.png`.replace(/[^\w .-]+/g, "-");
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
  }

  static number(value) {
    return Number(value.toPrecision(3)).toLocaleString("en", { maximumSignificantDigits: 3 });
  }
}
