// The interactive speed–accuracy chart: costs and measures are chosen, points and front follow.
// `chart` holds rows, axes and styles, written by chart_page.py.
const chart = JSON.parse(document.getElementById("chart-data").textContent);
const choose = (name) => document.getElementById(`chart-${name}`);

function shown() {
  const kind = choose("kind").value, all = choose("variants").checked;
  const x = choose("cost").value, y = choose("measure").value;
  const known = (row) => row[x] > 0 && row[y] !== null && isFinite(row[y]);
  return { x, y, rows: chart.rows.filter((row) =>
    row.kind === kind && known(row) && (all || row.usual)) };
}

// A GFC is better the higher it is; drawn is what is missing to 1. The sign of a level is no matter.
const error = (row, y) => y.includes("gfc") ? 1 - row[y] : Math.abs(row[y]);

function front(points) {
  const beats = (a, b) => a.x <= b.x && a.y <= b.y && (a.x < b.x || a.y < b.y);
  return points.filter((p) => !points.some((q) => beats(q, p))).sort((a, b) => a.x - b.x);
}

function hoverText(row, x, y) {
  const blending = row.blending ? `, ${row.blending}` : "";
  const numbers = chart.costs.concat(chart.measures).map(([name, label]) => {
    const value = row[name];
    return value === null ? "" : `${label}: ${Number(value.toPrecision(3))}`;
  });
  return [`<b>${row.method}</b>${blending}, every ${row.update_ms} ms, ${row.precision}`,
    ...numbers.filter((line) => line)].join("<br>");
}

function draw() {
  const { x, y, rows } = shown();
  const traces = Object.entries(chart.styles).map(([family, [colour, symbol]]) => {
    const mine = rows.filter((row) => row.family === family);
    return {
      name: family, mode: "markers", type: "scatter",
      x: mine.map((row) => row[x]), y: mine.map((row) => error(row, y)),
      text: mine.map((row) => hoverText(row, x, y)), hovertemplate: "%{text}<extra></extra>",
      marker: { color: colour, symbol, size: mine.map((row) => row.usual ? 12 : 7),
        opacity: mine.map((row) => row.usual ? 1 : 0.55), line: { color: "white", width: 0.5 } },
    };
  }).filter((trace) => trace.x.length);
  const best = front(rows.map((row) => ({ x: row[x], y: error(row, y) })));
  traces.push({ name: "front", mode: "lines", type: "scatter", hoverinfo: "skip",
    x: best.map((p) => p.x), y: best.map((p) => p.y),
    line: { color: "black", width: 1.2, shape: "hv" } });
  const label = (list, name) => list.find(([key]) => key === name)[1];
  const missing = y.includes("gfc") ? "1 − " : "";
  Plotly.react("chart-plot", traces, {
    xaxis: { type: "log", title: { text: label(chart.costs, x) } },
    yaxis: { type: "log", title: { text: missing + label(chart.measures, y) } },
    hovermode: "closest", height: 620, margin: { t: 20, r: 20 },
    legend: { orientation: "h", y: -0.16 },
    annotations: chart.simulated.includes(choose("kind").value) ? [{ text: "<b>SIMULATED</b>",
      xref: "paper", yref: "paper", x: 0, xanchor: "left", y: 1.03, showarrow: false, font: { color: "#D55E00" } }] : [],
  }, { responsive: true, displaylogo: false });
}

for (const name of ["kind", "cost", "measure", "variants"]) {
  choose(name).addEventListener("change", draw);
}
draw();
