"use strict";
// The page: what is done on it goes to the session as messages, what comes back is shown.

const $ = id => document.getElementById(id);
const map = new GroundMap($("map"));
const sticks = new Sticks();
const axes = ["forward", "left", "turn"].map(name => document.querySelector(`[data-axis=${name}]`));
let link = null, ended = false, last = null, lastEvent = 0, wasDeflected = false;

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
  link.onopen = () => notice("");
  link.onmessage = event => {
    const message = JSON.parse(event.data);
    if (message.hello) greet(message.hello);
    if (message.snapshot) show(message.snapshot);
    if (message.error) tell(message.error);
  };
  link.onclose = event => {
    ended = ended || Boolean(event.reason);
    notice(ended ? "the cockpit has ended" : "no connection: the cockpit has ended, or is busy");
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
  const switches = hello.layers.map(layer => {
    const label = labelled("checkbox", layer.replace("_", " "), { checked: true });
    label.dataset.layer = layer;
    label.firstChild.onchange = event => send({ do: "layer", layer, shown: event.target.checked });
    return label;
  });
  $("layers").replaceChildren($("layers").firstElementChild, ...switches);
  if (hello.meshcat) {
    const address = `http://${location.hostname}:${hello.meshcat}/`;
    if ($("meshcat").src !== address) $("meshcat").src = address;
  }
  last = null;
  lastEvent = 0;
  $("events").replaceChildren();
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
    document.querySelectorAll("#layers input").forEach(box => { box.checked = true; });
    for (const axis of axes) axis.value = 0;
    if (s.gait) $("gait").value = s.gait;
  } else if (!last.gait && s.gait) {
    $("gait").value = s.gait;
  }
  last = s;
  map.show(s);
  const walks = s.choice.planner === "velocity", over = s.state === "over";
  $("walking").hidden = !walks;
  $("map-hint").textContent = walks ? "a click puts something there" : "a click sets the goal, or puts something there";
  $("pause").textContent = s.state === "paused" ? "go on" : "pause";
  for (const id of ["pause", "step", "leap"]) $(id).disabled = over || s.state === "building";
  $("speed").value = s.speed === null ? "" : String(s.speed);
  const rate = s.state === "running" ? `, ${s.factor.toFixed(2)} x real time` : "";
  $("status").textContent = over ? `over: ${s.note}` : `${s.state}: ${s.time.toFixed(2)} s${rate}${s.phase ? ", " + s.phase : ""}`;
  showKinds(s.stock);
  showPicture("camera", s);
  showPicture("labels", s);
  showRobot(s);
  showEvents(s.happenings);
  showTimings(s.timings);
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
    ["forward, left, turn", numbers(s.velocity) + " m/s, rad/s"],
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

function command() {
  const [forward, left, turn] = axes.map(axis => Number(axis.value));
  axes.forEach(axis => { axis.nextElementSibling.textContent = Number(axis.value).toFixed(2); });
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
  send(what === "goal" ? { do: "goal", x: place[0], y: place[1] } : { do: "spawn", kind: what, x: place[0], y: place[1] });
};
$("choice").onsubmit = event => {
  event.preventDefault();
  const fields = $("choice").elements;
  send({ do: "begin", robot: fields.robot.value, terrain: fields.terrain.value, planner: fields.planner.value,
    seed: Number(fields.seed.value) });
};
$("pause").onclick = () => send({ do: last && last.state === "paused" ? "go_on" : "pause" });
$("step").onclick = () => send({ do: "step", number: 1 });
$("leap").onclick = () => send({ do: "step", number: 10 });
$("speed").onchange = event => send({ do: "speed", speed: event.target.value ? Number(event.target.value) : null });
$("end").onclick = () => { ended = true; send({ do: "end" }); };
$("stand").onclick = () => { for (const axis of axes) axis.value = 0; command(); };
$("gait").onchange = command;
for (const axis of axes) axis.oninput = command;
for (const button of document.querySelectorAll("[data-push]")) {
  button.onclick = () => {
    const [forward, left, up] = button.dataset.push.split(",").map(part => Number(part) * Number($("force").value));
    send({ do: "push", forward, left, up, duration: Number($("lasting").value) });
  };
}
setInterval(followSticks, 100);
connect();
