"use strict";
// The page: what is done on it goes to the session as messages, what comes back is shown.

const $ = id => document.getElementById(id);
const map = new GroundMap($("map"));
const sticks = new Sticks();
const axes = ["forward", "left", "turn"].map(name => document.querySelector(`[data-axis=${name}]`));
const ENDED = 4000, TOO_LARGE = 1009;  // why the server closes the link
const STANCE = "stance", WALKING = "trot";  // gaits: the one in which nobody walks, and what takes its place for a velocity
const AWAY = "no connection: the cockpit has ended, or is busy";
let link = null, ended = false, last = null, lastEvent = 0, settled = 0, wasDeflected = false, meshcat = "";

function send(message) {
  if (link && link.readyState === WebSocket.OPEN) link.send(JSON.stringify(message));
}

function notice(text) {
  $("notice").textContent = text;
  $("notice").hidden = !text;
}

function fill(select, names, words = {}) {
  select.replaceChildren(...names.map(name => new Option(words[name] || name, name)));
}

function connect() {
  link = new WebSocket(`ws://${location.host}/link`);
  link.onopen = () => { if ($("notice").textContent === AWAY) notice(""); };
  link.onmessage = event => {
    const message = JSON.parse(event.data);
    if (message.hello) greet(message.hello);
    if (message.snapshot) show(message.snapshot);
    if (message.error) tell(message.error);
  };
  link.onclose = event => {
    ended = ended || event.code === ENDED;
    if (event.code === TOO_LARGE) tell("the page has sent too large a message; it was ignored");
    else notice(ended ? "the cockpit has ended" : AWAY);
    if (!ended) setTimeout(connect, 1500);
  };
}

let noticed = 0;
function tell(text) {
  notice(text);
  clearTimeout(noticed);
  noticed = setTimeout(() => notice(""), 5000);
}

function greet(hello) {
  for (const key of ["robot", "terrain", "planner"]) {
    fill($("choice").elements[key], hello.choices[key], { velocity: "none: walk by velocity" });
  }
  fill($("gait"), hello.choices.gait);
  $("kinds").replaceChildren(...hello.kinds.map(kind => labelled("radio", kind, { name: "click", value: kind })));
  $("layers").replaceChildren(...hello.layers.map(layerSwitch));
  meshcat = hello.meshcat ? `http://${location.hostname}:${hello.meshcat}/` : "";
  showView();
  last = null;
  lastEvent = settled = 0;
  $("events").replaceChildren();
}

// A switch that is its layer's legend, too: what is drawn in which colours.
function layerSwitch({ layer, words, shape, colors }) {
  const label = labelled("checkbox", layer.replace("course/", "").replace("_", " "), { checked: true });
  label.dataset.layer = layer;
  label.title = words;
  label.append(...colors.map(([color, meaning]) => {
    const swatch = Object.assign(document.createElement("i"), { className: shape, title: meaning });
    swatch.style.setProperty("--color", color);
    return swatch;
  }));
  label.firstChild.onchange = event => send({ do: "layer", layer, shown: event.target.checked });
  return label;
}

// The 3-D view costs computing time of its own, without a graphics card much of it: it is loaded only where it is wanted.
function showView() {
  const wanted = Boolean($("view").checked && meshcat), source = wanted ? meshcat : "about:blank";
  if ($("meshcat").getAttribute("src") !== source) $("meshcat").src = source;
  $("meshcat").hidden = !wanted;
  $("no-view").hidden = wanted;
}

function labelled(type, text, properties) {
  const label = document.createElement("label"), input = document.createElement("input");
  Object.assign(input, { type, ...properties });
  label.append(input, " " + text);
  return label;
}

function show(s) {
  if (!last || last.number !== s.number) {
    for (const key of ["robot", "terrain", "planner"]) $("choice").elements[key].value = s.choice[key];
    $("choice").elements.seed.value = s.choice.seed;
  }
  if (s.position.length && settled !== s.number) settle(s);
  else if (last && s.gait && s.gait !== last.gait) $("gait").value = s.gait;
  last = s;
  map.show(s);
  const walks = s.choice.planner === "velocity", over = s.state === "over";
  $("walking").hidden = !walks;
  document.querySelector("#click input[value=goal]").disabled = walks;
  $("map-hint").textContent = walks ? "a click puts something there" : "a click sets the goal, or puts something there";
  $("pause").textContent = s.state === "paused" ? "go on" : "pause";
  for (const id of ["pause", "step", "leap"]) $(id).disabled = over || s.state === "building";
  $("speed").value = s.speed === null ? "" : String(s.speed);
  $("status").className = s.state;
  const rate = s.state === "running" ? `, ${s.factor.toFixed(2)} x real time` : "";
  $("status").textContent = over ? `over: ${s.note}` : `${s.state}: ${s.time.toFixed(2)} s${rate}${s.phase ? ", " + s.phase : ""}`;
  showKinds(s.stock);
  showPicture("camera", s);
  showPicture("labels", s);
  showRobot(s);
  showEvents(s.happenings);
  showTimings(s.timings);
}

// Brings the controls to what a trial that was not seen before is like: somebody else may have set it.
function settle(s) {
  settled = s.number;
  for (const label of document.querySelectorAll("#layers label")) {
    label.hidden = !(label.dataset.layer in s.layers);
    label.firstChild.checked = s.layers[label.dataset.layer] !== false;
  }
  axes.forEach((axis, k) => { axis.value = s.command[k] || 0; showValue(axis); });
  if (s.gait) $("gait").value = s.gait;
}

function showKinds(stock) {
  for (const input of document.querySelectorAll("#kinds input")) {
    input.disabled = stock[input.value] === 0;
    input.parentNode.title = `${stock[input.value]} left`;
  }
}

function showPicture(name, s) {
  const version = s.pictures[name];
  $(name).parentNode.style.visibility = version ? "" : "hidden";
  const address = `pictures/${name}.png?${version}`;
  if (version && !$(name).src.endsWith(address)) $(name).src = address;
}

function rows(table, lines, head) {
  const make = (cells, tag) => {
    const row = document.createElement("tr");
    row.append(...cells.map(cell => Object.assign(document.createElement(tag), { textContent: cell })));
    return row;
  };
  table.replaceChildren(...(head ? [make(head, "th")] : []), ...lines.map(line => make(line, "td")));
}

function showRobot(s) {
  const numbers = (values, digits = 2) => values.map(value => value.toFixed(digits)).join(", ");
  const lines = [
    ["base x, y, z", numbers(s.position) + " m"],
    ["roll, pitch, yaw", numbers(s.rpy) + " rad"],
    ["moves forward, left", numbers(s.velocity.slice(0, 2)) + " m/s"],
    ["turns", numbers(s.velocity.slice(2)) + " rad/s"],
    ["largest torque", (100 * s.torque).toFixed(0) + " % of its limit"],
  ];
  if (s.command.length) lines.push([`asked: ${s.gait}`, numbers(s.command) + " m/s, rad/s"]);
  if (s.goal) lines.push(["to the goal", Math.hypot(s.goal[0] - s.position[0], s.goal[1] - s.position[1]).toFixed(2) + " m"]);
  if (s.reason) lines.push([s.phase, s.reason]);
  for (const [name, count] of Object.entries(s.counts)) lines.push([name.replaceAll("_", " "), count]);
  rows($("robot"), s.position.length ? lines : []);
}

function showEvents(happenings) {
  for (const { number, time, kind, text } of happenings) {
    if (number <= lastEvent) continue;
    lastEvent = number;
    $("events").prepend(Object.assign(document.createElement("li"), { className: kind, textContent: `${time.toFixed(2)} s  ${text}` }));
  }
  while ($("events").children.length > 60) $("events").lastChild.remove();
}

function showTimings(timings) {
  const lines = Object.entries(timings).map(([stage, [, median, high, largest]]) =>
    [stage.replaceAll("_", " "), ...[median, high, largest].map(value => value.toFixed(value < 10 ? 2 : 0))]);
  rows($("timings"), lines, ["stage", "median", "95 %", "largest"]);
}

function showValue(axis) {
  axis.nextElementSibling.textContent = Number(axis.value).toFixed(2);
}

function command() {
  const [forward, left, turn] = axes.map(axis => Number(axis.value));
  if ($("gait").value === STANCE && (forward || left || turn)) $("gait").value = WALKING;
  axes.forEach(showValue);
  send({ do: "command", gait: $("gait").value, forward, left, turn });
}

function followSticks() {
  const pad = sticks.pad(), deflection = sticks.deflection();
  $("gamepad").textContent = pad ? `gamepad: ${pad.id}` : "no gamepad; keys W S A D Q E";
  if (!last || last.choice.planner !== "velocity" || !(deflection || wasDeflected)) return;
  axes.forEach((axis, k) => { axis.value = (deflection ? deflection[k] : 0) * axis.max; });
  wasDeflected = Boolean(deflection);
  command();
}

$("map").onclick = event => {
  const place = map.place(event);
  if (!place) return;
  const what = document.querySelector("input[name=click]:checked").value;
  if (what === "goal" && last.choice.planner === "velocity") return;
  send(what === "goal" ? { do: "goal", x: place[0], y: place[1] } : { do: "spawn", kind: what, x: place[0], y: place[1] });
};
$("choice").onsubmit = event => {
  event.preventDefault();
  const fields = $("choice").elements;
  send({ do: "begin", robot: fields.robot.value, terrain: fields.terrain.value, planner: fields.planner.value,
    seed: Number(fields.seed.value) });
};
$("view").onchange = showView;
$("pause").onclick = () => send({ do: last && last.state === "paused" ? "go_on" : "pause" });
$("step").onclick = () => send({ do: "step", number: 1 });
$("leap").onclick = () => send({ do: "step", number: 10 });
$("speed").onchange = event => send({ do: "speed", speed: event.target.value ? Number(event.target.value) : null });
$("end").onclick = () => { ended = true; send({ do: "end" }); };
$("stand").onclick = () => { for (const axis of axes) axis.value = 0; command(); };
$("gait").onchange = () => {
  if ($("gait").value === STANCE) for (const axis of axes) axis.value = 0;
  command();
};
for (const axis of axes) axis.oninput = command;
for (const button of document.querySelectorAll("[data-push]")) {
  button.onclick = () => {
    const [forward, left, up] = button.dataset.push.split(",").map(part => Number(part) * Number($("force").value));
    send({ do: "push", forward, left, up, duration: Number($("lasting").value) });
  };
}
$("view").checked = new URLSearchParams(location.search).get("view") !== "off";
setInterval(followSticks, 100);
connect();
