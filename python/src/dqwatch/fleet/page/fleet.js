"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  // Names come from logs: they are texts, never markup.
  const el = (tag, props, ...children) => {
    const e = document.createElement(tag);
    for (const [k, v] of Object.entries(props || {}))
      if (k === "style") for (const [p, x] of Object.entries(v)) e.style.setProperty(p, x);
      else if (k.startsWith("on")) e.addEventListener(k.slice(2), v);
      else if (k === "text") e.textContent = v;
      else e.setAttribute(k, v);
    for (const c of children) if (c !== null && c !== undefined) e.append(c);
    return e;
  };
  const svg = (tag, props, text) => {
    const e = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [k, v] of Object.entries(props || {})) e.setAttribute(k, v);
    if (text !== undefined) e.textContent = text;
    return e;
  };
  const types = { f4: Float32Array, f8: Float64Array, i4: Int32Array };
  const arrays = async (blob) => {
    const text = atob(blob.bytes), raw = new Uint8Array(text.length);
    for (let k = 0; k < raw.length; k++) raw[k] = text.charCodeAt(k);
    const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
    const buffer = await new Response(stream).arrayBuffer(), out = {};
    for (const [name, [type, at, count]] of Object.entries(blob.at)) out[name] = new types[type](buffer, at, count);
    return out;
  };

  const SHORT = { R_ohm: "R", Ld_H: "L_d", Lq_H: "L_q", psi_Wb: "ψ", dead_time_V: "dead time", J_kgm2: "J", B_Nms_rad: "B", coulomb_Nm: "friction", d_axis: "rest on d" };
  const PAINT = { weak_magnet: 0, strong_magnet: 0, current_sensor: 1, voltage_sensor: 1, worn_bearing: 2, low_friction: 2, inertia: 2, encoder_scale: 3, encoder_zero: 3, other_type: 4, batch: 5, winding: 6, low_resistance: 6, inductance: 6, inverter: 6 };
  const colour = (cause) => `var(--c${PAINT[cause] ?? 7})`;
  const PLURAL = { batch: "batches", axis: "axes", site: "sites" };
  const words = (name) => name.replaceAll("_", " ");
  const percent = (x, digits = 1) => `${x >= 0 ? "+" : "−"}${Math.abs(100 * x).toFixed(digits)} %`;
  // Of the rest on d logarithms are compared, of all else parts of the type's value.
  const part = (off, parameter) => parameter === "d_axis" ? Math.expm1(Math.max(-20, Math.min(20, off))) : off;
  const size_of = (o) => o.size ?? o.value;
  const date = (day) => new Date(day * 86400e3).toISOString().slice(0, 10);
  const minus = (x) => String(x).replace(/^-/, "−");
  const figure = (x) => {
    if (!isFinite(x)) return "–";
    const size = Math.abs(x), prefix = [[1e3, "k", 1e-3], [1, "", 1], [1e-3, "m", 1e3], [0, "µ", 1e6]].find((p) => size >= p[0]);
    return [(x * prefix[2]).toPrecision(4), prefix[1]];
  };
  const quantity = (x, unit) => unit === "%" ? `${x.toPrecision(3)} %` : `${figure(x).join(" ")}${unit}`;
  const standing = new Map(data.standing.map((s) => [s.motor, s]));

  const sign_text = (s) => s.what === "drift"
    ? `${SHORT[s.parameter]} ${percent(part(s.off))} in ${Math.round(data.weeks)} weeks`
    : s.parameter === "d_axis" ? `rest on d ${Math.exp(s.off).toFixed(1)} times the type's`
      : `${SHORT[s.parameter]} ${percent(part(s.off))} ± ${(100 * s.sd).toFixed(1)} of its type`;
  const why_text = (s) => {
    const like = s.cause === "other_type" ? ` Its numbers are those of ${s.like}.` : s.cause === "batch" ? ` ${s.like}.` : "";
    return `${s.says[0].toUpperCase()}${s.says.slice(1)}.${like} ${s.signs.slice(0, 3).map(sign_text).join(", ")}${s.also.length ? `; could also be ${s.also.map(words).join(", ")}` : ""}.`;
  };
  const due_text = (s) => {
    if (!s.crossing) return "";
    const [, at, low, high] = s.crossing;
    if (at === null) return `${(100 * data.limit).toFixed(0)} % passed before the first window`;
    const ends = isFinite(high) && high !== null ? `${date(low)} … ${date(high)}` : `not before ${date(low)}`;
    return at > data.last ? `${percent(Math.sign(s.signs.find((x) => x.what === "drift").off) * data.limit, 0)} on ${date(at)} (${ends})` : `${(100 * data.limit).toFixed(0)} % passed ${date(at)}`;
  };

  let summary = null, windows = null;
  const motor_of = (index) => data.motors[index];

  // Exports
  const save = (name, head, rows) => {
    // A cell that a spreadsheet would take for a formula is told to be a text.
    const cell = (x) => { let t = String(x ?? ""); if (/^[=+\-@\t\r]/.test(t) && !/^[+-]?[\d.]+(e[+-]?\d+)?$/i.test(t)) t = `'${t}`; return /[",\n\r]/.test(t) ? `"${t.replaceAll('"', '""')}"` : t; };
    const text = [head, ...rows].map((r) => r.map(cell).join(",")).join("\r\n") + "\r\n";
    const link = el("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: "text/csv" })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  const table = (head, rows, go) => el("div", { class: "scroll" }, el("table", {},
    el("thead", {}, el("tr", {}, ...head.map((h) => el("th", { text: h.replace(/^#/, ""), class: h.startsWith("#") ? "n" : "" })))),
    el("tbody", {}, ...rows.map((r, k) => el("tr", go ? { class: "go", tabindex: 0, onclick: () => go(k), onkeydown: (e) => e.key === "Enter" && go(k) } : {},
      ...r.map((x, c) => head[c].startsWith("#") ? el("td", { text: minus(x ?? ""), class: "n" }) : el("td", { text: x ?? "" })))))));

  // Pictures
  const line_plot = (place, o) => {
    const w = o.width || 188, h = o.height || 84, left = o.left || 34, right = 6, top = 6, bottom = o.height ? 20 : 14;
    const xs = o.points.map((p) => p[0]), ys = o.points.map((p) => p[1]);
    const x0 = Math.min(...xs, o.from ?? Infinity), x1 = Math.max(...xs, o.to ?? -Infinity, x0 + 1);
    let y0 = Math.min(...ys, ...(o.shown || []), o.least ?? 0), y1 = Math.max(...ys, ...(o.shown || []), o.least ? -o.least : 0);
    const air = 0.08 * (y1 - y0 || 1); y0 -= air; y1 += air;
    const X = (x) => left + (w - left - right) * (x - x0) / (x1 - x0), Y = (y) => top + (h - top - bottom) * (y1 - y) / (y1 - y0);
    const g = svg("svg", { viewBox: `0 0 ${w} ${h}`, role: "img" });
    if (o.band) g.append(svg("rect", { x: left, width: w - left - right, y: Y(Math.min(y1, o.band)), height: Math.max(0, Y(Math.max(y0, -o.band)) - Y(Math.min(y1, o.band))), fill: "var(--shade)" }));
    g.append(svg("line", { x1: left, x2: w - right, y1: Y(0), y2: Y(0), stroke: "var(--rule)" }));
    for (const l of o.limits || []) if (l > y0 && l < y1) g.append(svg("line", { x1: left, x2: w - right, y1: Y(l), y2: Y(l), stroke: "var(--bad)", "stroke-dasharray": "3 3" }));
    for (const y of [y0 + air, y1 - air]) g.append(svg("text", { x: left - 4, y: Y(y) + 4, "text-anchor": "end" }, minus(o.ratio ? Math.exp(y).toFixed(1) : (100 * part(y)).toFixed(1))));
    g.append(svg("text", { x: left, y: h - 2 }, date(x0).slice(5)), svg("text", { x: w - right, y: h - 2, "text-anchor": "end" }, date(x1).slice(5)));
    if (o.trend) g.append(svg("line", { x1: X(o.trend[0]), y1: Y(o.trend[1]), x2: X(o.trend[2]), y2: Y(o.trend[3]), stroke: o.colour, "stroke-width": 1.2, opacity: 0.55 }));
    for (const [x, y, s] of o.points) {
      if (s) g.append(svg("line", { x1: X(x), x2: X(x), y1: Y(Math.min(y1, y + s)), y2: Y(Math.max(y0, y - s)), stroke: o.colour, opacity: 0.5 }));
      g.append(svg("circle", { cx: X(x), cy: Y(y), r: 2.4, fill: o.colour }));
    }
    place.append(g);
    return g;
  };

  const tip = $("tip");
  const show_tip = (e, text) => { tip.textContent = text; tip.style.display = text ? "block" : "none"; tip.style.left = `${Math.min(e.clientX + 12, innerWidth - tip.offsetWidth - 8)}px`; tip.style.top = `${e.clientY + 14}px`; };

  // Every motor as a dot, a line a parameter of a type: how many spreads it is from its type.
  const glance = () => {
    const canvas = $("glance"), context = canvas.getContext("2d"), ratio = Math.min(2, devicePixelRatio || 1);
    const style = getComputedStyle(document.documentElement), paint = (name) => style.getPropertyValue(name).trim();
    const lane = 26, gap = 24, left = 74, width = canvas.clientWidth || 520;
    const lanes = [];
    let y = 6, last = null;
    for (const [k, o] of data.of.entries()) {
      if (o.type !== last) { y += 20; lanes.push({ title: o.type || "all motors", y: y - 6 }); last = o.type; y += 4; }
      lanes.push({ k, o, y: y + lane / 2 });
      y += lane;
    }
    const height = y + 22;
    canvas.style.height = `${height}px`;
    // The list is as long as the picture beside it.
    $("standing").style.setProperty("max-height", matchMedia("(max-width: 860px)").matches ? "none" : `${Math.max(400, height + 30 - $("causes").offsetHeight)}px`);
    canvas.width = width * ratio; canvas.height = height * ratio;
    context.scale(ratio, ratio);
    const most = 40, squeeze = (z) => Math.sign(z) * Math.log1p(Math.abs(z) / 3) / Math.log1p(most / 3);
    const X = (z) => left + (width - left - 12) * (0.5 + 0.5 * squeeze(Math.max(-most, Math.min(most, z))));
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "center";
    for (const z of [-30, -10, -3, 0, 3, 10, 30]) {
      context.fillStyle = paint("--grid");
      context.fillRect(X(z) - 0.5, 14, 1, height - 34);
      context.fillStyle = paint("--quiet");
      context.fillText(z > 0 ? `+${z}` : `${z}`.replace("-", "−"), X(z), height - 6);
    }
    const spots = [];
    for (const l of lanes) {
      context.textAlign = l.title ? "left" : "right";
      context.fillStyle = paint(l.title ? "--text" : "--quiet");
      context.font = `${l.title ? "600 " : ""}12px system-ui, sans-serif`;
      context.fillText(l.title || SHORT[l.o.parameter], l.title ? 0 : left - 10, l.title ? l.y : l.y + 4);
      if (l.title) continue;
      const m = summary[`m${l.k}`], z = summary[`z${l.k}`], sz = summary[`sz${l.k}`];
      context.fillStyle = paint("--dot");
      context.globalAlpha = m.length > 2000 ? 0.35 : 0.6;
      const loud = [];
      for (let j = 0; j < m.length; j++) {
        const s = standing.get(motor_of(m[j]));
        const mine = s && s.signs.find((x) => x.parameter === l.o.parameter);
        if (mine) { loud.push([j, s, mine.what === "drift" && Math.abs(sz[j]) > Math.abs(z[j]) ? sz[j] : z[j]]); continue; }
        // The same motor has the same height in all lanes.
        context.fillRect(X(z[j]) - 1, l.y + ((m[j] * 0.618034) % 1 - 0.5) * (lane - 10) - 1, 2, 2);
      }
      context.globalAlpha = 1;
      for (const [j, s, zj] of loud) {
        context.fillStyle = paint(colour(s.cause).slice(4, -1));
        const at = [X(zj), l.y + ((m[j] * 0.618034) % 1 - 0.5) * (lane - 10)];
        context.beginPath(); context.arc(at[0], at[1], 3.6, 0, 7); context.fill();
        spots.push([...at, m[j], s, l.o.parameter, zj]);
      }
    }
    const near = (e) => {
      const box = canvas.getBoundingClientRect(), x = e.clientX - box.left, v = e.clientY - box.top;
      let best = null, least = 100;
      for (const s of spots) { const d = (s[0] - x) ** 2 + (s[1] - v) ** 2; if (d < least) least = d, best = s; }
      return best;
    };
    canvas.onmousemove = (e) => { const s = near(e); canvas.style.cursor = s ? "pointer" : ""; show_tip(e, s ? `${motor_of(s[2])}: ${words(s[3].cause)}, ${SHORT[s[4]]} ${minus(s[5].toFixed(1))} spreads off` : ""); };
    canvas.onmouseleave = () => { tip.style.display = "none"; };
    canvas.onclick = (e) => { const s = near(e); if (s) open(s[2]); };
  };

  // Who stands out
  const chosen = new Set();
  const out_list = () => {
    const list = $("standing");
    list.replaceChildren();
    const some = data.standing.filter((s) => chosen.size === 0 || chosen.has(s.cause));
    const batches = new Set();
    for (const s of some.slice(0, 300)) {
      if (s.cause === "batch") {
        // One entry for all of it.
        if (batches.has(s.like)) continue;
        batches.add(s.like);
        const names = some.filter((x) => x.cause === "batch" && x.like === s.like);
        const chips = el("span", { class: "chips" });
        for (const x of names.slice(0, 60)) chips.append(el("button", { class: "chip", text: x.motor, onclick: () => open(x.index) }));
        list.append(el("div", { class: "row group" }, el("span", { class: "swatch", style: { color: colour(s.cause) } }),
          el("span", { class: "top" }, el("span", { class: "name", text: `batch ${s.like}` }), el("span", { class: "quiet", text: `${s.type} · ${names.length} motors` })),
          el("span", { class: "why" }, `${s.signs.map(sign_text).join(", ")}: the whole batch.`, chips)));
        continue;
      }
      list.append(el("button", { class: "row", onclick: () => open(s.index) },
        el("span", { class: "swatch", style: { color: colour(s.cause) } }),
        el("span", { class: "top" }, el("span", { class: "name", text: s.motor }), el("span", { class: "quiet", text: [s.type, words(s.cause)].filter(Boolean).join(" · ") }), el("span", { class: "due", text: due_text(s) })),
        el("span", { class: "why", text: why_text(s) })));
    }
    if (some.length > 300) list.append(el("p", { text: `${some.length - 300} more: the table has them all.` }));
    if (!some.length) list.append(el("p", { text: "None: every motor is as the others of its type." }));
  };
  const chips = () => {
    const counts = new Map();
    for (const s of data.standing) counts.set(s.cause, (counts.get(s.cause) || 0) + 1);
    for (const [cause, n] of [...counts].sort((a, b) => b[1] - a[1])) {
      const chip = el("button", { class: "chip", "aria-pressed": "false", title: data.causes[cause], style: { color: colour(cause) }, onclick: () => { chosen.has(cause) ? chosen.delete(cause) : chosen.add(cause); chip.setAttribute("aria-pressed", chosen.has(cause)); out_list(); } },
        el("span", { class: "swatch" }), words(cause), el("b", { text: n }));
      $("causes").append(chip);
    }
  };

  const points_of = (k, motor) => {
    const at = windows[`w${k}`], y = windows[`y${k}`], s = windows[`s${k}`], out = [];
    const begin = windows[`b${k}`];
    // Windows stand by motor: those of one are neighbours.
    const m = summary[`m${k}`];
    let low = 0, high = m.length - 1;
    while (low < high) { const middle = (low + high) >> 1; m[middle] < motor ? low = middle + 1 : high = middle; }
    if (m[low] !== motor) return [out, -1];
    for (let n = begin[low]; n < begin[low + 1]; n++) out.push([windows.day[at[n]], y[n], s[n]]);
    return [out, low];
  };
  const drifts = () => {
    const place = $("drifts"), drifting = data.standing.filter((s) => s.signs.some((x) => x.what === "drift"));
    $("drift-card").hidden = drifting.length === 0;
    for (const s of drifting.slice(0, 60)) {
      const sign = s.signs.find((x) => x.what === "drift" && (!s.crossing || x.parameter === s.crossing[0])) || s.signs.find((x) => x.what === "drift");
      const k = data.of.findIndex((o) => o.type === s.type && o.parameter === sign.parameter);
      const [points, j] = points_of(k, s.index);
      const box = el("button", { class: "multiple", title: why_text(s), onclick: () => open(s.index) },
        el("span", { class: "name", text: s.motor }), el("span", { class: "quiet", text: `${SHORT[sign.parameter]}, %: ${words(s.cause)}` }));
      line_plot(box, { points, colour: colour(s.cause), band: 2 * data.of[k].spread, limits: [data.limit, -data.limit] });
      place.append(box);
    }
    if (drifting.length > 60) place.append(el("p", { text: `${drifting.length - 60} more in the table.` }));
  };

  const groups = () => {
    $("unlike-card").hidden = !data.unlike.length && !data.common.length;
    for (const u of data.unlike) {
      const row = el("div", {}, el("h2", { text: `${words(u.key)} ${u.label}: ${SHORT[u.parameter]} ${percent(part(u.off))} ± ${(100 * u.sd).toFixed(1)}` }),
        el("p", { text: `${u.motors.length} motors of ${u.type || "the fleet"}, ${Math.abs(u.z).toFixed(0)} deviations from the other ${PLURAL[u.key] || u.key}.` }));
      const names = el("div", { class: "chips" });
      for (const m of u.motors.slice(0, 40)) names.append(el("button", { class: "chip", text: motor_of(m), onclick: () => open(m) }));
      row.append(names);
      $("unlike").append(row);
    }
    for (const c of data.common) {
      const row = el("div", {}, el("h2", { text: `${words(c.key)} ${c.label}: ${SHORT[c.parameter]} of ${c.motors} motors changes together` }),
        el("p", { text: "Against the rest of the fleet, in percent. It is taken off before a single motor is judged: a supply, a season, an update." }));
      line_plot(row, { points: c.weeks.map((x, k) => [x, c.change[k], c.sd[k]]), colour: "var(--line)", width: 520, height: 120, left: 40 });
      $("unlike").append(row);
    }
  };

  const type_rows = () => data.of.map((o) => [o.type || "–", SHORT[o.parameter], quantity(o.value, o.unit), (100 * o.sd).toFixed(2), (100 * o.spread).toFixed(2), o.per_K === null ? "" : `${(100 * o.per_K).toFixed(3)} ± ${(100 * o.per_K_sd).toFixed(3)}`, o.parameter === "d_axis" ? "" : (700 * o.drift).toFixed(3).replace(/^-(0\.0+)$/, "$1"), o.motors]);
  const TYPE_HEAD = ["type", "parameter", "#location", "#± %", "#spread %", "#%/K", "#drift %/week", "#motors"];
  const TABLE_HEAD = ["motor", "type", "batch", "axis", "site", "firmware", "windows", "cause", "signs", "also", "crosses", "from", "to"];
  const table_row = (m) => {
    const s = standing.get(motor_of(m));
    return [motor_of(m), ...["type", "batch", "axis", "site", "firmware"].map((g) => data.groups[g] && data.groups[g].of[m] >= 0 ? data.groups[g].labels[data.groups[g].of[m]] : ""), data.windows_of[m], s ? words(s.cause) : "", s ? s.signs.map(sign_text).join("; ") : "", s ? s.also.map(words).join(" ") : "", ...(s && s.crossing ? s.crossing.slice(1).map((d) => d !== null && isFinite(d) ? date(d) : "") : ["", "", ""])];
  };
  const all_motors = () => {
    const list = $("motors"), wanted = $("search").value.trim().toLowerCase(), found = [];
    for (let m = 0; m < data.motors.length && found.length < 101; m++)
      if (!wanted || table_row(m).join(" ").toLowerCase().includes(wanted)) found.push(m);
    const shown = found.slice(0, 100);
    list.replaceChildren(table(TABLE_HEAD.slice(0, 9).map((h) => h === "windows" ? "#windows" : h), shown.map((m) => table_row(m).slice(0, 9)), (k) => open(shown[k])));
    $("more").textContent = found.length > 100 ? "The first hundred; search for others. The export has all." : "";
  };

  // One motor
  const open = (m) => { history.pushState(null, "", `#${m}`); show(); };
  const show = () => {
    const m = location.hash.length > 1 ? Number(location.hash.slice(1)) : -1;
    const one = Number.isInteger(m) && m >= 0 && m < data.motors.length;
    $("fleet").hidden = one;
    $("one").hidden = !one;
    tip.style.display = "none";
    if (one && windows) motor_page(m);
    if (one) scrollTo(0, 0);
  };
  const motor_page = (m) => {
    const place = $("one"), name = motor_of(m), s = standing.get(name), row = table_row(m);
    place.replaceChildren(el("div", { class: "bar" }, el("button", { class: "act", text: "← the fleet", onclick: () => { history.pushState(null, "", "#"); show(); } }), el("button", { class: "act", text: "its windows as CSV", onclick: () => export_windows(m) })),
      el("header", {}, el("h1", { text: name }), el("p", { text: TABLE_HEAD.slice(1, 6).map((h, k) => row[k + 1] ? (row[k + 1].startsWith(h) ? row[k + 1] : `${h} ${row[k + 1]}`) : "").filter(Boolean).join(" · ") })));
    const verdict = el("section", { class: "card" });
    if (s) verdict.append(el("h2", { text: words(s.cause), style: { color: colour(s.cause) } }), el("p", { text: why_text(s) }), s.crossing ? el("p", { text: `${SHORT[s.crossing[0]]}: ${due_text(s)}` }) : null,
      table(["parameter", "what", "#off", "#± %", "#deviations", "#q"], s.signs.map((x) => [SHORT[x.parameter], x.what, percent(part(x.off, x.parameter)), (100 * x.sd).toFixed(2), x.z.toFixed(1), x.q.toPrecision(2)])));
    else if (!data.of.some((_, k) => points_of(k, m)[1] >= 0)) verdict.append(el("h2", { text: "Not compared" }), el("p", { text: "No parameter is told of it, or of fewer than five motors of its type." }));
    else verdict.append(el("h2", { text: "As the others of its type" }), el("p", { text: "No parameter and no drift of it stands out at 1 % false discoveries." }));
    place.append(verdict);
    const plots = el("div", { class: "two" });
    for (const [k, o] of data.of.entries()) {
      const [points, j] = points_of(k, m);
      if (j < 0) continue;
      const z = summary[`z${k}`][j], sz = summary[`sz${k}`][j], t = summary[`t${k}`][j], off = summary[`o${k}`][j];
      const card = el("section", { class: "card" }, el("h2", { text: `${SHORT[o.parameter]}  ${quantity(o.value + size_of(o) * part(off, o.parameter), o.unit)}` }),
        el("p", { text: `${percent(part(off, o.parameter), 2)} of its type (${minus(z.toFixed(1))} deviations)${isFinite(sz) && o.parameter !== "d_axis" ? `; ${percent(7 * t, 2)} a week (${minus(sz.toFixed(1))})` : ""}` }));
      const days = points.map((p) => p[0]), middle = summary[`d${k}`][j], ratio = o.parameter === "d_axis";
      const trend = isFinite(t) && points.length > 2 ? [days[0], off + (t + o.drift) * (days[0] - middle), days[days.length - 1], off + (t + o.drift) * (days[days.length - 1] - middle)] : null;
      line_plot(card, { points, trend, ratio, colour: s && s.signs.some((x) => x.parameter === o.parameter) ? colour(s.cause) : "var(--line)", band: 2 * o.spread, least: -2.2 * o.spread, limits: ratio ? [] : [data.limit, -data.limit], width: 520, height: 170, left: 42 });
      plots.append(card);
    }
    place.append(plots);
    const lost = data.lost.filter((l) => l.index === m);
    if (lost.length) place.append(el("section", { class: "card" }, el("h2", { text: "What was not told, and why" }), table(["window", "verdict", "why"], lost.map((l) => [l.window, words(l.verdict), l.why]))));
  };
  const export_windows = (m) => {
    const rows = [];
    for (const [k, o] of data.of.entries()) {
      const [points] = points_of(k, m);
      for (const [day, y, s] of points) rows.push([motor_of(m), date(day), o.parameter, (o.value + size_of(o) * part(y, o.parameter)).toPrecision(7), (o.parameter === "d_axis" ? o.value * Math.exp(y) * s : o.size * s).toPrecision(3), part(y, o.parameter).toPrecision(4)]);
    }
    save("windows.csv", ["motor", "day", "parameter", "value_at_reference", "sd", "off"], rows);
  };

  const begin = async () => {
    document.title = data.title;
    $("title").textContent = data.headline;
    $("about").textContent = data.about;
    chips();
    out_list();
    summary = await arrays(data.summary);
    glance();
    $("types").append(table(TYPE_HEAD, type_rows()));
    $("lost-card").hidden = data.lost.length === 0 && data.faults.length === 0;
    $("lost").append(table(["motor", "window", "verdict", "why"], [...data.faults.map((l) => [motor_of(l.index), l.window, "faults", l.why]), ...data.lost.slice(0, 200).map((l) => [motor_of(l.index), l.window, words(l.verdict), l.why])]));
    all_motors();
    $("search").addEventListener("input", all_motors);
    $("export-standing").onclick = () => save("standing.csv", TABLE_HEAD, data.standing.map((s) => table_row(s.index)));
    $("export-motors").onclick = () => save("motors.csv", TABLE_HEAD, data.motors.map((_, m) => table_row(m)));
    $("export-types").onclick = () => save("types.csv", TYPE_HEAD.map((h) => h.replace("#", "")), type_rows());
    document.documentElement.dataset.first = performance.now().toFixed(0);
    await new Promise((go) => setTimeout(go, 0));
    windows = await arrays(data.windows);
    drifts();
    groups();
    show();
    document.documentElement.dataset.ready = performance.now().toFixed(0);
  };
  addEventListener("popstate", show);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => summary && glance());
  let resized = 0;
  addEventListener("resize", () => { clearTimeout(resized); resized = setTimeout(() => summary && glance(), 150); });
  begin();
})();
