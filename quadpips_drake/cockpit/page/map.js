"use strict";
// The map from above: the terrain's picture, and on it what moves. World x points to the right, y upwards.

const COMMAND_COLOR = "#0073d9", PUSH_COLOR = "#f2400d";
const LEG_COLORS = ["#1f78b5", "#f28010", "#2ba12b", "#bf268c"];  // LF, RF, LH, RH, as in all pictures

class GroundMap {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.image = new Image();
    this.image.onload = () => this.draw();
    this.version = "";
    this.snapshot = null;
    this.trail = [];
    this.trial = 0;
  }

  show(snapshot) {
    if (snapshot.number !== this.trial || snapshot.time < (this.snapshot ? this.snapshot.time : 0)) {
      this.trial = snapshot.number;
      this.trail = [];
    }
    this.snapshot = snapshot;
    const version = snapshot.pictures.map || "";
    if (version && version !== this.version) {
      this.version = version;
      this.image.src = "pictures/map.png?" + version;
    }
    const [x, y] = snapshot.position;
    const last = this.trail[this.trail.length - 1];
    if (x !== undefined && (!last || Math.hypot(x - last[0], y - last[1]) > 0.03)) {
      this.trail.push([x, y]);
      if (this.trail.length > 600) this.trail.shift();
    }
    this.draw();
  }

  // Pixels of a point in the world, and the other way round.
  pixel([x, y]) {
    const [low, high, bottom, top] = this.snapshot.view;
    return [(x - low) / (high - low) * this.canvas.width, (top - y) / (top - bottom) * this.canvas.height];
  }

  place(event) {
    if (!this.snapshot || !this.snapshot.view.length) return null;
    const [low, high, bottom, top] = this.snapshot.view;
    const box = this.canvas.getBoundingClientRect();
    const u = (event.clientX - box.left) / box.width, v = (event.clientY - box.top) / box.height;
    return [low + u * (high - low), top - v * (top - bottom)];
  }

  scale() {
    return this.canvas.width / (this.snapshot.view[1] - this.snapshot.view[0]);
  }

  line(points, color, width, dash = []) {
    const c = this.context;
    c.beginPath();
    points.forEach((point, k) => (k ? c.lineTo(...this.pixel(point)) : c.moveTo(...this.pixel(point))));
    c.strokeStyle = color;
    c.lineWidth = width;
    c.setLineDash(dash);
    c.stroke();
    c.setLineDash([]);
  }

  disc(point, radius, color, filled) {
    const c = this.context;
    c.beginPath();
    c.arc(...this.pixel(point), radius, 0, 2 * Math.PI);
    c[filled ? "fillStyle" : "strokeStyle"] = color;
    c.lineWidth = 2;
    filled ? c.fill() : c.stroke();
  }

  draw() {
    const s = this.snapshot, c = this.context;
    c.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (!s || !s.view.length) return;
    if (this.image.complete && this.image.naturalWidth) c.drawImage(this.image, 0, 0, this.canvas.width, this.canvas.height);
    const shown = layer => s.layers[layer] !== false;
    this.line(this.trail, "#1b2a3d88", 2);
    if (shown("base_reference")) this.line(s.path, "#d91a26", 2, [6, 4]);
    if (shown("footholds")) for (const [leg, x, y] of s.footholds) this.disc([x, y], 4, LEG_COLORS[leg], false);
    if (s.goal && shown("course/goal")) {
      this.disc(s.goal, 0.3 * this.scale(), "#c2185b", false);
      this.disc(s.goal, 5, "#c2185b", true);
    }
    if (s.position.length) this.drawRobot(s);
    this.drawScale();
  }

  drawScale() {
    const c = this.context, y = this.canvas.height - 14;
    c.fillStyle = "#1d2733";
    c.font = "17px system-ui, sans-serif";
    c.fillRect(14, y, this.scale(), 3);
    c.fillText("1 m", 14, y - 6);
  }

  drawRobot(s) {
    s.feet.forEach(([x, y, stands], leg) => this.disc([x, y], 5, LEG_COLORS[leg], stands > 0));
    const [x, y] = s.position, yaw = s.rpy[2], forward = [Math.cos(yaw), Math.sin(yaw)], left = [-forward[1], forward[0]];
    const corner = (a, b) => [x + a * forward[0] + b * left[0], y + a * forward[1] + b * left[1]];
    this.line([corner(-0.3, 0.13), corner(0.3, 0.13), corner(0.42, 0), corner(0.3, -0.13), corner(-0.3, -0.13), corner(-0.3, 0.13)],
      "#16202d", 3);
    if (s.command.length && s.layers.command) this.line([[x, y], corner(s.command[0], s.command[1])], COMMAND_COLOR, 5);
    const size = Math.hypot(...s.push);
    if (size > 0) this.line([[x, y], [x + s.push[0] / size, y + s.push[1] / size]], PUSH_COLOR, 6);
  }
}
