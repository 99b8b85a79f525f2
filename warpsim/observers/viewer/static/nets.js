// Which parts of the networks are drawn: as the scene has it, or, at a person's wish, of all networks alike.
"use strict";

class Nets {
  constructor() {
    this.nets = new Map();     // slot -> Net
    this.wishes = new Map();   // part -> whether it is drawn of all networks; absent: as the scene has it
  }

  clear() {
    this.nets.clear();
  }

  join(slot, net) {
    this.nets.set(slot, net);
    net.draw(this.parts(net));
  }

  parts(net) {
    const own = Object.entries(net.own).map(([part, shown]) => [part, this.wishes.has(part) ? this.wishes.get(part) : shown]);
    return Object.fromEntries(own);
  }

  // The parts that some network has, and of how many of those it is drawn: {part: "all", "some" or "none"}.
  state() {
    const found = {};
    for (const part of ["points", "springs", "surface"]) {
      const having = [...this.nets.values()].filter((net) => net.has[part]), drawn = having.filter((net) => net.shown[part]);
      if (having.length > 0) found[part] = drawn.length === 0 ? "none" : drawn.length < having.length ? "some" : "all";
    }
    return found;
  }

  // To and fro between what the scene has and the other thing: drawn of all, or of none where the scene draws it of all.
  toggle(part) {
    const having = [...this.nets.values()].filter((net) => net.has[part]);
    if (!this.wishes.delete(part)) this.wishes.set(part, !having.every((net) => net.own[part]));
    for (const net of this.nets.values()) net.draw(this.parts(net));
  }
}
