// Soft particles that cover one another must be drawn from far to near.  A counting sort of 16-bit depths orders a hundred
// thousand in a few milliseconds, into an index buffer that stays in place.
"use strict";

class DepthOrder {
  constructor() {
    this.keys = new Uint16Array(0);
    this.starts = new Uint32Array(65536);
    this.weights = [0, 0, 0];
    this.sorted = null;    // the places that were sorted last
  }

  // places: Uint16Array, four to a point; toward: how much a full component counts toward the eye; index: Uint32Array to fill.
  // Returns whether the order may have changed.
  sort(places, count, toward, index) {
    const reach = Math.abs(toward[0]) + Math.abs(toward[1]) + Math.abs(toward[2]);
    const [a, b, c] = reach > 0 ? toward.map((x) => x / reach) : [0, 0, 1];
    const turned = Math.abs(a - this.weights[0]) + Math.abs(b - this.weights[1]) + Math.abs(c - this.weights[2]);
    if (places === this.sorted && turned < 1e-4) return false;
    this.sorted = places;
    this.weights = [a, b, c];
    if (this.keys.length < count) this.keys = new Uint16Array(Math.ceil(1.5 * count));
    const { keys, starts } = this, bias = -65535 * (Math.min(a, 0) + Math.min(b, 0) + Math.min(c, 0));
    starts.fill(0);
    for (let i = 0, p = 0; i < count; i++, p += 4) {
      const key = (a * places[p] + b * places[p + 1] + c * places[p + 2] + bias) & 65535;
      keys[i] = key;
      starts[key]++;
    }
    for (let key = 0, at = 0; key < 65536; key++) {
      const next = at + starts[key];
      starts[key] = at;
      at = next;
    }
    for (let i = 0; i < count; i++) index[starts[keys[i]]++] = i;
    return true;
  }
}
