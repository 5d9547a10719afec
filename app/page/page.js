"use strict";
(function () {
  const plots = JSON.parse(document.getElementById("plots").textContent);
  const places = document.querySelectorAll(".plot");
  let graphs = [];

  // Colours are those of the page's style, light or dark.
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const faint = (name, alpha) => {
    const hex = parseInt(colour(name).slice(1), 16);
    return `rgba(${hex >> 16}, ${(hex >> 8) & 255}, ${hex & 255}, ${alpha})`;
  };
  const number = (digits) => (value) => String(+value.toPrecision(digits)).replace(/-/g, "\u2212");

  // Means stand between the points as rows of their own.
  function mergedRows(plot) {
    const blank = plot.series.map(() => null);
    const points = plot.rows.map((row) => row.concat(blank));
    const means = plot.means.map((row) => [row[0]].concat(blank, row.slice(1)));
    return points.concat(means).sort((a, b) => a[0] - b[0]);
  }

  // A value with its bounds, and a second line without.
  const bandRows = (plot) => plot.rows.map(([x, value, low, high, ...others]) => [x, value === null ? null : [low, value, high], ...others.map((v) => (v === null ? null : [v, v, v]))]);

  // Each series with its bounds.
  const bandsRows = (plot) => plot.rows.map((row) => [row[0], ...plot.series.map((_, k) => (row[1 + 3 * k] === null ? null : [row[2 + 3 * k], row[1 + 3 * k], row[3 + 3 * k]]))]);

  // Bars from zero, the second series narrower and in front of the first.
  function bars(e) {
    const points = e.points;
    let gap = Infinity;
    for (let k = 1; k < points.length; k++) gap = Math.min(gap, points[k].canvasx - points[k - 1].canvasx);
    const first = e.seriesIndex === 0;
    const width = Math.max(1, Math.min(gap, 24) * (first ? 0.8 : 0.45));
    const zero = e.dygraph.toDomYCoord(0);
    e.drawingContext.fillStyle = e.color;
    for (const p of points)
      if (!isNaN(p.canvasy)) e.drawingContext.fillRect(p.canvasx - width / 2, p.canvasy, width, zero - p.canvasy);
  }

  // Degrees in parts of a turn.
  function degrees(from, to) {
    const step = [15, 30, 45, 90].find((s) => (to - from) / s <= 9) || 90;
    const ticks = [];
    for (let v = Math.ceil(from / step) * step; v <= to; v += step) ticks.push({ v, label: String(v) });
    return ticks;
  }

  function shade(plot) {
    return (context, area, graph) => {
      context.fillStyle = colour("shade");
      for (const [from, to] of plot.shaded) {
        const left = Math.max(area.x, graph.toDomXCoord(from)), right = Math.min(area.x + area.w, graph.toDomXCoord(to));
        if (right > left) context.fillRect(left, area.y, right - left, area.h);
      }
      context.fillStyle = colour("bad");
      context.font = "600 12px system-ui, sans-serif";
      for (const [at, text] of plot.marks) {
        const x = graph.toDomXCoord(at);
        if (x < area.x || x > area.x + area.w) continue;
        context.fillRect(x - 0.75, area.y, 1.5, area.h);
        context.fillText(text, x + 4, area.y + 12);
      }
    };
  }

  // The key names the series, and gives the values under the pointer.
  function key(data) {
    const hovered = data.x !== undefined;
    const items = data.series
      .filter((s) => !/ mean$/.test(s.label) || (hovered && s.y !== undefined && s.y !== null))
      .map((s) => `<span style="color:${colour(s.label.replace(" mean", ""))}">\u25cf</span> ${s.label}` + (hovered && s.y !== undefined && s.y !== null && !isNaN(s.y) ? ` <b>${number(4)(s.y)}</b>` : ""));
    return (hovered ? `${number(5)(data.x)}: ` : "") + items.join(" \u2002");
  }

  function options(plot, label) {
    const points = plot.kind === "points", few = plot.rows.length < 300;
    const labels = ["x"].concat(plot.series), colours = plot.series.map((s) => (points ? faint(s, few ? 0.7 : 0.35) : colour(s)));
    const series = {};
    for (const s of plot.series) series[s] = points ? { drawPoints: true, pointSize: few ? 2.5 : 1.7, strokeWidth: 0, highlightCircleSize: 3 } : { strokeWidth: s === "measured" ? 4 : 1.3 };
    if (points)
      for (const s of plot.series) {
        labels.push(s + " mean");
        colours.push(colour(s));
        series[s + " mean"] = { strokeWidth: 2, connectSeparatedPoints: true, highlightCircleSize: 3 };
      }
    if (plot.kind === "band") series.healthy = { strokeWidth: 1, strokePattern: [6, 4], fillAlpha: 0 };
    if (plot.series.includes("reference")) series.reference = { strokeWidth: 1, strokePattern: [6, 4] };
    if (plot.kind === "bars") for (const s of plot.series) series[s] = { plotter: bars };
    return {
      labels, colors: colours, series,
      labelsDiv: label, legend: "always", legendFormatter: key,
      xlabel: plot.x, ylabel: plot.y, xLabelHeight: 16, yLabelWidth: 16,
      gridLineColor: colour("grid"), axisLineColor: colour("rule"), gridLineWidth: 1,
      axes: { x: Object.assign({ pixelsPerLabel: 60, axisLabelFormatter: number(7) }, plot.x.endsWith("[\u00b0]") ? { ticker: degrees } : {}), y: { pixelsPerLabel: 34, axisLabelWidth: 54, axisLabelFormatter: number(5) } },
      xRangePad: points || plot.kind === "bars" ? 8 : 0, yRangePad: plot.kind === "bars" || plot.log ? 0 : 6,
      includeZero: plot.kind === "bars", logscale: plot.log, underlayCallback: shade(plot),
      customBars: plot.kind === "band" || plot.kind === "bands", fillAlpha: 0.25, valueRange: plot.range,
      animatedZooms: false, rightGap: 8,
    };
  }

  function draw() {
    for (const graph of graphs) graph.destroy();
    graphs = plots.map((plot, k) => {
      const rows = plot.kind === "points" ? mergedRows(plot) : plot.kind === "band" ? bandRows(plot) : plot.kind === "bands" ? bandsRows(plot) : plot.rows;
      return new Dygraph(places[k], rows, options(plot, places[k].parentElement.querySelector(".key")));
    });
  }

  draw();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  // Paper is white and narrower than the window.
  addEventListener("beforeprint", () => {
    document.documentElement.dataset.print = "";
    document.body.style.width = "680px";
    draw();
  });
  addEventListener("afterprint", () => {
    delete document.documentElement.dataset.print;
    document.body.style.width = "";
    draw();
  });
})();
