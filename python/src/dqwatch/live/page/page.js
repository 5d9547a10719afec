// The page: what the server tells, as text; no text becomes markup.
"use strict";
const $ = id => document.getElementById(id);
const state = { tiles: new Map(), events: new Map(), sources: [], health: {}, number: 0, traces: new Map() };
const LOOKS = { healthy: "healthy", learning: "learning", fault: "fault named", stalled: "no rows" };
const SPOKEN = { R_ohm: "R", Ld_H: "L_d", Lq_H: "L_q", psi_Wb: "flux ψ", dead_time_V: "dead time", angle_rad: "encoder angle",
  offset_A: "current offset", phase_resistance_ohm: "resistance of one phase", phase_reactance_H: "inductance of one phase",
  gain: "current gain", short_S: "shorted turns", friction_Nm: "friction", temperature_K: "winding above cold", residual_V: "residual" };
const MAIN = ["R_ohm", "Ld_H", "Lq_H", "psi_Wb", "dead_time_V", "temperature_K", "residual_V"];

function make(tag, name, text) {
  const e = document.createElement(tag);
  if (name) e.className = name;
  if (text !== undefined) e.textContent = text;
  return e;
}
function svg(tag, attributes) {
  const e = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const k in attributes) e.setAttribute(k, attributes[k]);
  return e;
}
const unitOf = name => { const u = name.slice(name.lastIndexOf("_") + 1); return { ohm: "Ω", gain: "" }[u] ?? (name.includes("_") ? u : ""); };
function quantity(x, name, digits = 4) {
  if (x === null || x === undefined) return "–";
  const unit = unitOf(name), steps = [["", 1], ["m", 1e-3], ["µ", 1e-6], ["n", 1e-9]];
  const [prefix, size] = !unit || x === 0 ? steps[0] : steps.find(([, s]) => Math.abs(x) >= s) || steps[3];
  const text = (x / size).toPrecision(digits);
  return (text.includes("e") ? String(Number(text)) : text).replace("-", "−") + (unit ? " " + prefix + unit : "");
}
const spokenFault = e => e.fault.replaceAll("_", " ") + (e.phase ? ", phase " + e.phase : "");
const clock = t => new Date(1000 * t).toLocaleTimeString();

function tileOf(t) {
  const a = make("a", "tile " + t.look);
  a.href = "#m/" + t.slug;
  a.dataset.slug = t.slug;
  a.append(make("span", "name", t.name), make("span", "look", t.look === "fault" ? t.fault.replaceAll("_", " ") + (t.phase ? ", phase " + t.phase : "") : LOOKS[t.look] || ""));
  let more = "";
  if (t.look === "stalled") more = t.silent_s === null ? "no row has come yet" : "for " + t.silent_s + " s";
  else if (t.look === "fault") more = "confidence " + t.confidence.toFixed(2) + (t.events > 1 ? ", " + t.events + " events" : "");
  else if (t.look === "learning") more = t.why;
  if (more) a.append(make("span", "more", more));
  const seen = make("span", "seen"), bar = make("span", "bar"), part = make("i");
  part.style.width = (100 * t.watched / Math.max(t.channels, 1)) + "%";
  bar.append(part);
  seen.append(bar, document.createTextNode(t.watched + " of " + t.channels + " watched"));
  a.append(seen);
  return a;
}

function eventOf(e, withMotor) {
  const li = make("li"), what = make("span", "what");
  li.dataset.id = e.id;
  what.append(make("b", "", spokenFault(e)), document.createTextNode((withMotor ? " · " + e.motor : "") + " · " + (SPOKEN[e.parameter] || e.parameter) + " " + quantity(e.value, e.parameter) + (e.healthy === null ? "" : ", healthy " + quantity(e.healthy, e.parameter))));
  li.append(make("span", "when", clock(e.at_unix_s)), what, make("span", "sure", "confidence " + e.confidence.toFixed(2)), make("span", "advice", e.advice));
  const row = make("span", "log"), traced = state.traces.get(e.id);
  if (e.capture) {
    const button = make("button", "", "Trace these minutes"), link = make("a", "", "its log");
    button.addEventListener("click", () => trace(e.id));
    link.href = "api/event/" + encodeURIComponent(e.id) + "/log";
    if (traced && (traced.state === "running" || traced.state === "waiting")) { button.disabled = true; button.textContent = "Tracing …"; }
    row.append(button, link);
  } else row.append(make("span", "", "The minute after it is being gathered."));
  if (traced && traced.state === "done") row.append(make("span", "verdict", verdict(traced.trace)));
  if (traced && traced.state === "failed") row.append(make("span", "verdict", "No trace: " + traced.error));
  li.append(row);
  return li;
}
function verdict(t) {
  const found = (t.effects || []).map(x => x.name || x.effect || "").filter(Boolean);
  return String(t.sentence || "Verdict: " + String(t.verdict).replaceAll("_", " ")) + (found.length ? " Found: " + found.join(", ") + "." : "");
}

async function trace(id) {
  const url = "api/event/" + encodeURIComponent(id) + "/trace";
  try {
    await fetch(url, { method: "POST", headers: { "X-Dqwatch": "1" } });
    for (;;) {
      const found = await (await fetch(url)).json();
      state.traces.set(id, found);
      draw();
      if (found.state !== "running" && found.state !== "waiting") return;
      await new Promise(done => setTimeout(done, 1000));
    }
  } catch (error) { state.traces.set(id, { state: "failed", error: String(error) }); draw(); }
}

const keep = new WeakMap();
function fill(parent, nodes, key) {
  if (keep.get(parent) === key) return;
  keep.set(parent, key);
  parent.replaceChildren(...nodes());
}

function drawAll() {
  const tiles = [...state.tiles.values()].sort((a, b) => a.name.localeCompare(b.name, undefined, { numeric: true }));
  const events = [...state.events.values()].reverse();
  fill($("tiles"), () => tiles.map(tileOf), JSON.stringify(tiles));
  fill($("events"), () => events.slice(0, 50).map(e => eventOf(e, true)), JSON.stringify([events.slice(0, 50), [...state.traces]]));
  $("quiet").hidden = events.length > 0;
  const count = look => tiles.filter(t => t.look === look).length;
  $("summary").textContent = [tiles.length + (tiles.length === 1 ? " motor" : " motors"), ...["fault", "stalled", "learning", "healthy"].filter(count).map(l => count(l) + " " + ({ fault: "with a fault", stalled: "without rows" }[l] || l))].join(" · ");
  fill($("sources"), () => state.sources.map(sourceOf), JSON.stringify(state.sources));
  const trouble = [...(state.health.trouble || [])];
  if (state.health.unknown_rows) trouble.push(state.health.unknown_rows + " rows of motors that are not configured, the first of “" + state.health.first_unknown + "”");
  $("trouble").hidden = trouble.length === 0;
  fill($("trouble"), () => trouble.map(t => make("li", "", t)), JSON.stringify(trouble));
}
function sourceOf(s) {
  const li = make("li");
  li.append(make("b", "", s.name), make("span", "kind", s.kind), make("span", s.connected ? "good" : "bad", s.connected ? "connected" : s.trouble || "not connected yet"));
  if (s.losses) li.append(make("span", "kind", "lost " + s.losses + (s.losses === 1 ? " time" : " times")));
  if (s.broken) li.append(make("span", "bad", s.broken + " broken messages dropped, the first: " + s.first_broken));
  if (s.dropped) li.append(make("span", "bad", s.dropped + " messages dropped, too many waited"));
  return li;
}

function plotOf(name, m, events) {
  const points = m.history.filter(p => p[name]).map(p => [p.t_s, ...p[name]]), now = m.parameters[name];
  const figure = make("figure"), caption = make("figcaption");
  figure.dataset.parameter = name;
  caption.append(make("span", "name", SPOKEN[name] || name), make("span", "now", quantity(now.value, name) + (now.sd === null || now.sd === undefined ? "" : " ± " + quantity(now.sd, name, 2))));
  figure.append(caption);
  if (points.length < 2) return figure;
  const t0 = points[0][0], t1 = points[points.length - 1][0], all = [];
  // What was learned first may be anything: the last half says where the plot looks.
  for (const [, v, sd, healthy, band] of points.slice(Math.floor(points.length / 4))) {
    all.push(v);
    if (sd !== null && sd < Math.abs(v)) all.push(v - 2 * sd, v + 2 * sd);
    if (healthy !== null && band !== null && name !== "temperature_K" && name !== "residual_V") all.push(healthy - 1.15 * band, healthy + 1.15 * band);
  }
  let low = Math.min(...all), high = Math.max(...all);
  if (!(high > low)) { low -= Math.abs(low) * 0.05 + 1e-12; high += Math.abs(high) * 0.05 + 1e-12; }
  const x = t => 400 * (t - t0) / (t1 - t0), y = v => 118 - 116 * (Math.max(low, Math.min(high, v)) - low) / (high - low);
  const path = f => points.map(f).filter(Boolean).map(([a, b], k) => (k ? "L" : "M") + a.toFixed(1) + " " + b.toFixed(1)).join("");
  const picture = svg("svg", { viewBox: "0 0 400 120", preserveAspectRatio: "none", role: "img", "aria-label": (SPOKEN[name] || name) + " over time" });
  const known = points.filter(p => p[2] !== null);
  if (known.length > 1) picture.append(svg("path", { class: "sd", d: "M" + [...known.map(p => x(p[0]).toFixed(1) + " " + y(p[1] + 2 * p[2]).toFixed(1)), ...known.slice().reverse().map(p => x(p[0]).toFixed(1) + " " + y(p[1] - 2 * p[2]).toFixed(1))].join("L") + "Z" }));
  if (name !== "temperature_K" && name !== "residual_V")
    for (const sign of [-1, 1]) picture.append(svg("path", { class: "lim", d: path(p => p[3] !== null && p[4] !== null && [x(p[0]), y(p[3] + sign * p[4])]) }));
  picture.append(svg("path", { class: "ok", d: path(p => p[3] !== null && [x(p[0]), y(p[3])]) }));
  picture.append(svg("path", { class: "line", d: path(p => [x(p[0]), y(p[1])]) }));
  for (const e of events) if (e.t_s >= t0 && e.t_s <= t1) picture.append(svg("line", { class: "mark", x1: x(e.t_s), x2: x(e.t_s), y1: 0, y2: 120 }));
  const ends = make("div", "ends");
  ends.append(make("span", "", quantity(low, name, 3) + " … " + quantity(high, name, 3)), make("span", "", Math.round(t1 - t0) + " s"));
  figure.append(picture, ends);
  return figure;
}

let shown = null;
function drawOne() {
  const m = shown, events = [...state.events.values()].filter(e => e.motor === m.name).reverse();
  $("head").className = m.look;
  $("head").replaceChildren(make("h1", "", m.name), make("span", "look", m.look === "fault" ? m.fault.replaceAll("_", " ") : LOOKS[m.look]), make("span", "more", (m.stage || "").replaceAll("_", " ") + ", " + m.watched + " of " + m.channels + " watched" + (m.why ? ": " + m.why : "")));
  const names = MAIN.filter(n => m.parameters[n] && m.history.some(p => p[n]));
  $("plots").replaceChildren(...names.map(n => plotOf(n, m, events)));
  fill($("own"), () => events.map(e => eventOf(e, false)), JSON.stringify([events, [...state.traces]]));
  $("ownquiet").hidden = events.length > 0;
  const head = make("tr");
  for (const t of ["parameter", "now", "deviation", "healthy", "would be told", "watched"]) head.append(make("th", "", t));
  const rows = Object.entries(m.parameters).map(([n, p]) => {
    const tr = make("tr");
    tr.append(make("td", "", SPOKEN[n] || n), make("td", "", quantity(p.value, n)), make("td", "", quantity(p.sd, n, 2)), make("td", "", quantity(p.healthy, n)), make("td", "", p.least_change === null ? "–" : "± " + quantity(p.least_change, n, 3)), make("td", p.watched ? "yes" : "", p.watched ? "yes" : p.why || "no"));
    return tr;
  });
  $("channels").replaceChildren(head, ...rows);
  const counts = { rows: m.rows, "left out: late": m.counts.late, "left out: too many": m.counts.dropped, gaps: m.counts.gaps, "clock set back": m.counts.clock_set, ...m.refused };
  $("counts").replaceChildren(...Object.entries(counts).filter(([, v]) => v !== null).map(([k, v]) => { const d = make("div"); d.append(make("dt", "", k.replaceAll("_", " ")), make("dd", "", String(v))); return d; }), ...m.notes.map(n => make("div", "", n)));
}
function route() {
  const slug = location.hash.startsWith("#m/") ? location.hash.slice(3) : "";
  return state.tiles.has(slug) ? slug : "";
}
async function look() {
  const slug = route();
  if (!slug) { shown = null; return draw(); }
  try {
    const answer = await fetch("api/motor/" + encodeURIComponent(slug));
    if (answer.ok && route() === slug) shown = await answer.json();
  } catch (error) { /* the stream says that the server is gone */ }
  draw();
}
function draw() {
  const slug = route();
  $("all").hidden = Boolean(slug && shown);
  $("one").hidden = !(slug && shown);
  drawAll();
  if (slug && shown) drawOne();
}
function say(on, text) { $("link").className = on ? "on" : ""; $("link").lastChild.textContent = text; }

const stream = new EventSource("api/stream");
stream.addEventListener("open", () => say(true, "live"));
stream.addEventListener("error", () => say(false, "lost, connecting again"));
stream.addEventListener("message", message => {
  const data = JSON.parse(message.data);
  for (const t of data.tiles) state.tiles.set(t.slug, t);
  for (const e of data.events) state.events.set(e.id, e);
  state.sources = data.sources;
  state.health = data.health;
  say(true, "live");
  if (route() && !shown) look(); else draw();
});
addEventListener("hashchange", () => { shown = null; scrollTo(0, 0); look(); });
setInterval(() => { if (route()) look(); }, 1000);
