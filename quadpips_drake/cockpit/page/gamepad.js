"use strict";
// Velocity from a gamepad's sticks or from keys, in parts of the largest one: forward, left, turn in [-1, 1].

const DEAD_BAND = 0.1;
const AXES = [1, 0, 2];  // of forward, left and turn; sticks count to the right and downwards
const KEYS = { w: [1, 0, 0], s: [-1, 0, 0], a: [0, 1, 0], d: [0, -1, 0], q: [0, 0, 1], e: [0, 0, -1] };

class Sticks {
  constructor() {
    this.pressed = new Set();
    window.addEventListener("keydown", event => {
      const writes = event.target.matches && event.target.matches("input[type=number], select");
      if (!writes && !event.ctrlKey && !event.metaKey && event.key.toLowerCase() in KEYS) this.pressed.add(event.key.toLowerCase());
    });
    window.addEventListener("keyup", event => this.pressed.delete(event.key.toLowerCase()));
    window.addEventListener("blur", () => this.pressed.clear());
  }

  pad() {
    const pads = navigator.getGamepads ? Array.from(navigator.getGamepads()) : [];
    return pads.find(pad => pad && pad.connected && pad.axes.length > 2) || null;
  }

  // What is asked for now; null where nobody touches anything.
  deflection() {
    if (this.pressed.size) {
      const sum = [0, 0, 0];
      for (const key of this.pressed) KEYS[key].forEach((value, k) => { sum[k] += value; });
      return sum;
    }
    const pad = this.pad();
    if (!pad) return null;
    const values = AXES.map(axis => (Math.abs(pad.axes[axis]) > DEAD_BAND ? -pad.axes[axis] : 0));
    return values.some(value => value !== 0) ? values : null;
  }
}
