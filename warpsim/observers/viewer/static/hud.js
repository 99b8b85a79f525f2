// The words on the picture: what runs, when it is, how many live, how fast it comes.  Names are set as text, never as HTML.
"use strict";

class Hud {
  constructor(element) {
    this.element = element;
    this.rows = new Map();
    this.arrivals = [];
    this.told = 0;
    this.pace = "";       // of the run, as it says
    this.still = false;   // it stands still: nothing has a pace
  }

  set(scene) {
    document.body.classList.remove("night", "dusk", "day");
    document.body.classList.add(scene.sky);
    this.element.textContent = "";
    this.rows.clear();
    this.row("name").textContent = scene.name;
    document.title = `${scene.name} - warpsim`;
  }

  row(key, className = key) {
    if (!this.rows.has(key)) {
      const line = document.createElement("div");
      line.className = className;
      this.element.appendChild(line);
      this.rows.set(key, line);
    }
    return this.rows.get(key);
  }

  // Words that change 60 times a second cannot be read: ten are enough.
  frame(time, clouds) {
    const now = performance.now();
    this.arrivals.push(now);
    while (now - this.arrivals[0] > 1000) this.arrivals.shift();
    if (now - this.told < 100) return;
    this.told = now;
    this.row("time").textContent = `${time.toFixed(2)} s`;
    clouds.forEach((cloud, slot) => {
      const drawn = cloud.count < cloud.live ? ` (${cloud.count.toLocaleString("en")} drawn)` : "";
      this.row(`cloud ${slot}`, "").textContent = `${cloud.live.toLocaleString("en")} ${cloud.name}${drawn}`;
    });
    this.row("rate", "faint").textContent = this.still ? "" : `${this.arrivals.length} frames/s${this.pace}`;
  }

  status(status) {
    this.still = !status.playing;
    if (this.still) this.row("rate", "faint").textContent = "";
    const steps = status.steps_per_second, factor = status.real_time_factor, short = (x) => Number(x.toPrecision(2)).toLocaleString("en");
    this.pace = steps > 0 ? ` · ${short(steps)} steps/s` : "";
    if (factor > 0) this.pace += ` · ${short(factor)}× real time`;
    this.say([status.playing ? "" : "paused", status.recording ? "recording" : "", status.note].filter((s) => s).join(" · "));
  }

  say(words) {
    this.row("state", "faint").textContent = words;
  }
}
