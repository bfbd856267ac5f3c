"use strict";
// Draws the charts of `gensig report` from the block of data in the page. Text of the data set is never taken as markup.
(() => {
  const DATA = JSON.parse(document.getElementById("data").textContent);
  // Okabe & Ito (2008), "Color universal design", without black, yellow on dark ground only; symbols and dashes tell more classes apart
  const COLORS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#7F7F7F"];
  const ON_DARK = ["#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#F0E442", "#D55E00", "#AAAAAA"];
  const SYMBOLS = ["circle", "square", "triangle-up", "diamond", "cross", "x", "star", "triangle-down"];
  const DASHES = ["solid", "dash", "dot", "dashdot"];
  const MARKS = {
    mesh: { label: "mesh harmonics", color: "#E69F00", dash: "solid" },
    sidebands: { label: "sidebands", color: "#009E73", dash: "dot" },
    shafts: { label: "shaft orders", color: "#CC79A7", dash: "dash" },
    fault: { label: "fault frequency", color: "#D55E00", dash: "dashdot" },
  };
  const N_SIDEBANDS = 5, N_SHAFT_ORDERS = 10, N_FAULT_ORDERS = 12, ZOOM_TURNS = 12;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const coarse = window.matchMedia("(pointer: coarse)");

  // ---- numbers -------------------------------------------------------------------------------------------------
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const floats = (text) => Array.from(new Float32Array(bytes(text).buffer), (x) => (Number.isFinite(x) ? x : null));
  const wave = (packed) => Array.from(new Int16Array(bytes(packed.n).buffer), (x) => x * packed.scale);
  const amplitudes = (packed) => Array.from(bytes(packed.n), (x) => (x ? packed.top * 10 ** (((x - 255) * packed.step_db) / 20) : 0));
  const ramp = (n, start, step, factor) => Array.from({ length: n }, (_, i) => (start + i * step) * factor);
  const short = (x) => (x === null || x === undefined ? "unknown" : String(Number(x.toPrecision(4))));
  const safe = (text) => String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;"); // plotly reads some tags
  const unit = (text) => safe(text).replace("^2", "²");

  // ---- page ----------------------------------------------------------------------------------------------------
  const chosen = (name) => {
    const form = document.getElementById(name + "-controls"), values = {};
    for (const field of form.elements) values[field.name] = field.type === "checkbox" ? field.checked : field.value;
    return values;
  };
  const say = (name, text) => { document.getElementById(name + "-said").textContent = text; };
  const style = (i) => ({ color: (dark.matches ? ON_DARK : COLORS)[i % COLORS.length], symbol: SYMBOLS[i % SYMBOLS.length], dash: DASHES[Math.floor(i / COLORS.length) % DASHES.length] });

  function draw(name, traces, layout, what) {
    const node = document.getElementById("plot-" + name), ink = dark.matches ? "#e6edf3" : "#1b1f24", grid = dark.matches ? "#333b44" : "#e3e8ed";
    const axis = { gridcolor: grid, zerolinecolor: grid, linecolor: grid, automargin: true, exponentformat: "none" };
    const full = {
      margin: { l: 60, r: 12, t: 32, b: 44 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: ink, size: 12 }, legend: { orientation: "h", yref: "container", y: 0, yanchor: "bottom", x: 0 }, hovermode: "closest",
      dragmode: coarse.matches ? false : "zoom", ...layout,
      xaxis: { ...axis, ...layout.xaxis }, yaxis: { ...axis, exponentformat: layout.yaxis.type === "log" ? "power" : "none", ...layout.yaxis },
    };
    node.setAttribute("aria-label", what);
    Plotly.react(node, traces, full, { responsive: true, displaylogo: false, displayModeBar: coarse.matches ? false : "hover", scrollZoom: false });
  }

  // ---- signals -------------------------------------------------------------------------------------------------
  function machine(record) {
    const mine = DATA.examples.filter((one) => one.unit === record.unit && one !== record);
    const sound = mine.find((one) => one.class === "healthy" && one.condition === record.condition);
    return sound || mine.filter((one) => one.severity < record.severity).sort((a, b) => a.severity - b.severity)[0];
  }

  function name_of(record) {
    const f = record.frequencies, parts = [record.class, "severity " + short(record.severity), record.unit, record.record];
    if (f.drive) parts.push(short(f.drive * 60) + " r/min of the driving shaft");
    parts.push(short(record.torque) + " N m");
    if (f.mesh) parts.push("mesh " + short(f.mesh) + " Hz");
    if (record.fault) parts.push(record.fault + " fault once in " + short(1000 / f[record.fault]) + " ms (" + short(f[record.fault]) + " Hz)");
    return parts.join(", ");
  }

  function frequencies_to_mark(record, chosen_marks, low, high) {
    const f = record.frequencies, found = {};
    const keep = (values) => values.filter((x) => x > 0 && x >= low && x <= high);
    const multiples = (x, n) => (x ? Array.from({ length: n }, (_, i) => (i + 1) * x) : []);
    const harmonics = multiples(f.mesh, f.mesh ? Math.min(Math.floor(high / f.mesh), 200) : 0);
    const carrier = f[record.fault] || f.pinion;
    if (chosen_marks.mesh) found.mesh = keep(harmonics);
    if (chosen_marks.sidebands && carrier) {
      const offsets = Array.from({ length: 2 * N_SIDEBANDS + 1 }, (_, i) => i - N_SIDEBANDS).filter((i) => i !== 0);
      found.sidebands = keep(harmonics.flatMap((x) => offsets.map((i) => x + i * carrier)));
    }
    if (chosen_marks.shafts) found.shafts = keep(["pinion", "wheel", "drive"].flatMap((name) => multiples(f[name], N_SHAFT_ORDERS)));
    if (chosen_marks.fault && record.fault) found.fault = keep(multiples(f[record.fault], N_FAULT_ORDERS));
    return found;
  }

  function mark_traces(marks, factor, bottom, top) {
    return Object.entries(marks).filter(([, at]) => at.length).map(([name, at]) => ({
      x: at.flatMap((x) => [x * factor, x * factor, null]), y: at.flatMap(() => [bottom, top, null]), mode: "lines", name: MARKS[name].label,
      line: { color: MARKS[name].color, width: 1, dash: MARKS[name].dash }, opacity: 0.75, hovertemplate: "%{x:.5~g}<extra>" + MARKS[name].label + "</extra>",
    }));
  }

  function draw_spectrum(plot, key, shown, values, range_hz, factor, axis_title, amplitude_title) {
    const lines = shown.filter((one) => one.view[key]).map((one) => {
      const packed = one.view[key], y = amplitudes(packed);
      return { x: ramp(y.length, packed.start, packed.step, factor), y: values.decibel ? y.map((a) => a || null) : y, mode: "lines", name: one.label, line: { color: one.color, width: 1 } };
    });
    const record = shown[shown.length - 1].record;
    const end = range_hz ? range_hz[1] : Math.max(...shown.filter((one) => one.view[key]).map((one) => one.view[key].start + one.view[key].step * bytes(one.view[key].n).length), 0);
    const tops = shown.filter((one) => one.view[key]).map((one) => one.view[key].top).filter((x) => x > 0);
    const top = tops.length ? Math.max(...tops) : 1, bottom = values.decibel ? top * 1e-5 : 0;
    const marks = mark_traces(frequencies_to_mark(record, values, range_hz ? range_hz[0] : 0, end), factor, bottom, values.decibel ? top * 2 : top * 1.08);
    const range = values.decibel ? [Math.log10(bottom), Math.log10(top * 2)] : [0, top * 1.08];
    const x_range = range_hz ? range_hz.map((x) => x * factor) : [0, end * factor];
    draw(plot, [...marks, ...lines], {
      xaxis: { title: { text: axis_title }, range: x_range }, yaxis: { title: { text: amplitude_title }, type: values.decibel ? "log" : "linear", range, dtick: values.decibel ? 1 : undefined },
    }, (key === "spectrum" ? "Amplitude spectrum: " : "Envelope spectrum: ") + shown.map((one) => name_of(one.record)).join("; beside ") + ". Marked: " + (marks.map((one) => one.name).join(", ") || "nothing"));
  }

  function draw_signals() {
    const values = chosen("signals"), record = DATA.examples[Number(values.record)], channel = Number(values.channel), view = record.views[channel];
    const beside = values.other === "same" ? machine(record) : values.other === "" ? undefined : DATA.examples[Number(values.other)];
    const reference = values.axis === "hz" ? null : record.frequencies[values.axis];
    const label = (one) => safe(one.class + " " + short(one.severity) + ", " + one.record);
    const shown = beside && beside !== record ? [{ record: beside, view: beside.views[channel], label: label(beside), color: "#7F7F7F" }] : [];
    shown.push({ record, view, label: label(record), color: dark.matches ? "#56B4E9" : "#0072B2" });
    const orders = values.axis === "mesh" ? "orders of the mesh" : "orders of the " + (values.axis === "drive" ? "driving shaft" : values.axis);
    const frequency_title = reference ? orders : "frequency, Hz", factor = reference ? 1 / reference : 1;
    const time_title = reference ? (values.axis === "mesh" ? "meshes" : "turns") + (values.axis === "mesh" ? "" : " of the " + (values.axis === "drive" ? "driving shaft" : values.axis)) : "time, ms";
    const of = DATA.channels[channel], amplitude_title = "amplitude, " + unit(of.unit);
    say("signals", of.name + ": " + name_of(record) + (beside && beside !== record ? ". Grey: " + name_of(beside) : values.other === "same" ? ". This page has no less damaged record of this machine" : "") + ".");

    const own = (one) => (values.axis === "hz" ? 1e3 : one.record.frequencies[values.axis] || 1e3); // each over its own turns
    draw("wave", shown.map((one) => {
      const y = wave(one.view.wave);
      return { x: ramp(y.length, 0, one.view.wave.step, own(one)), y, mode: "lines", name: one.label, line: { color: one.color, width: 1 }, opacity: 0.9 };
    }), { xaxis: { title: { text: time_title } }, yaxis: { title: { text: safe(of.name) + ", " + unit(of.unit) } } }, "Waveform of " + name_of(record));

    const mesh = record.frequencies.mesh, turn = record.frequencies[record.fault] || record.frequencies.pinion || record.frequencies.drive;
    const center = values.zoom === "all" || !mesh ? null : Number(values.zoom) * mesh;
    const range = center ? [Math.max(center - ZOOM_TURNS * turn, 0), Math.min(center + ZOOM_TURNS * turn, DATA.top)] : null;
    draw_spectrum("spectrum", "spectrum", shown, values, range, factor, frequency_title, amplitude_title);
    draw_spectrum("envelope", "envelope", shown, values, null, factor, frequency_title, amplitude_title);

    const packed = view.spectrogram, flat = amplitudes(packed), [columns, rows] = packed.shape, z = [];
    const floor = packed.top * 1e-5 || 1e-30;
    for (let j = 0; j < rows; j++) z.push(Array.from({ length: columns }, (_, i) => 20 * Math.log10(Math.max(flat[i * rows + j], floor))));
    const highest = 20 * Math.log10(packed.top || 1e-30);
    draw("spectrogram", [{
      type: "heatmap", z, x: ramp(columns, packed.time, packed.time_step, own({ record })), y: ramp(rows, 0, packed.step, factor), colorscale: "Cividis", zmin: highest - 70, zmax: highest,
      colorbar: { title: { text: "dB re 1 " + unit(of.unit), side: "right" }, thickness: 12 }, hovertemplate: "%{x:.4~g}, %{y:.4~g}: %{z:.1f} dB<extra></extra>",
    }], { xaxis: { title: { text: time_title } }, yaxis: { title: { text: frequency_title } } }, "Spectrogram of " + name_of(record) + ", the last 70 dB");
  }

  // ---- parameters and indicators -------------------------------------------------------------------------------
  const columns = {};
  function column(table, name) {
    const key = table + "/" + name;
    if (!(key in columns)) columns[key] = floats(DATA[table].columns[name]);
    return columns[key];
  }
  const classes = (table) => bytes(DATA[table].class);
  const selected = (name, field) => { const s = document.getElementById(name + "-controls").elements[field]; return s.options[s.selectedIndex].text; };

  function by_class(table, x, y) {
    const label = classes(table);
    return DATA.classes.map((name, i) => {
      const rows = Array.from(label.keys()).filter((row) => label[row] === i && x[row] !== null && y[row] !== null);
      return { name, i, rows, x: rows.map((row) => x[row]), y: rows.map((row) => y[row]) };
    }).filter((one) => one.rows.length);
  }
  const boxes = (groups, of) => groups.map((one) => ({
    type: "box", y: one[of], name: safe(one.name), boxpoints: "all", jitter: 0.6, pointpos: 0, fillcolor: "rgba(0,0,0,0)",
    marker: { color: style(one.i).color, symbol: style(one.i).symbol, size: 4, opacity: 0.6 }, line: { color: style(one.i).color, width: 1.5 }, showlegend: false,
  }));

  function draw_parameters() {
    const values = chosen("parameters"), y = column("drawn", values.column), groups = by_class("drawn", y, y), text = selected("parameters", "column");
    const all = groups.flatMap((one) => one.y), low = Math.min(...all), high = Math.max(...all), size = (high - low) / 30 || 1;
    say("parameters", text + ": " + groups.map((one) => one.name + " " + one.rows.length + " records, " + short(Math.min(...one.y)) + " to " + short(Math.max(...one.y))).join("; "));
    if (values.form === "boxes") return draw("parameters", boxes(groups, "y"), { yaxis: { title: { text: safe(text) } } }, text + " by class, boxes");
    draw("parameters", groups.map((one) => ({
      type: "histogram", x: one.x, name: safe(one.name), xbins: { start: low, end: high + size / 1e3, size }, marker: { color: style(one.i).color, pattern: { shape: ["", "/", "x", "."][Math.floor(one.i / COLORS.length) % 4] } },
    })), { barmode: "stack", xaxis: { title: { text: safe(text) } }, yaxis: { title: { text: "records" } } }, text + " by class, histogram");
  }

  function draw_indicators() {
    const values = chosen("indicators"), n = DATA.channels.length, channel = Number(values.channel), of = DATA.channels[channel];
    const y = column("measured", values.indicator).filter((_, i) => i % n === channel), x = column("measured", values.along), groups = by_class("measured", x, y);
    const title = selected("indicators", "indicator") + (values.indicator === "rms" ? ", " + of.unit.replace("^2", "²") : ""), over = selected("indicators", "along");
    const median = (list) => { const s = [...list].sort((a, b) => a - b), m = s.length >> 1; return s.length % 2 ? s[m] : (s[m - 1] + s[m]) / 2; };
    say("indicators", of.name + ", " + title + ", medians: " + (groups.map((one) => one.name + " " + short(median(one.y))).join(", ") || "none known"));
    const axis = { title: { text: safe(title) }, type: values.decibel ? "log" : "linear" };
    draw("indicators", groups.map((one) => ({
      x: one.x, y: one.y, mode: "markers", type: "scatter", name: safe(one.name), marker: { color: style(one.i).color, symbol: style(one.i).symbol, size: 6, opacity: 0.75 },
    })), { xaxis: { title: { text: safe(over) } }, yaxis: axis }, title + " over " + over + ", by class");
    draw("levels", boxes(groups, "y"), { yaxis: axis }, title + " by class, boxes");
  }

  // ---- lives and measurements ----------------------------------------------------------------------------------
  function draw_lives() {
    const values = chosen("lives"), table = DATA.lives, life = column("lives", "life"), time = column("lives", "life_time_h"), left = column("lives", "remaining_life_h"), label = classes("lives");
    const y = column("lives", values.quantity), failed = column("lives", "life_failed"), seen = new Set();
    const rows_of = table.names.map(() => []);
    life.forEach((number, row) => rows_of[number].push(row));
    const traces = rows_of.filter((rows) => rows.length).map((rows) => {
      const last = rows[rows.length - 1], i = Math.max(...rows.map((row) => label[row])), first = !seen.has(i), at = style(i);
      seen.add(i);
      return {
        x: rows.map((row) => (values.relative ? time[row] / (time[row] + left[row]) : time[row])), y: rows.map((row) => y[row]), mode: "lines+markers", name: safe(DATA.classes[i]),
        legendgroup: String(i), showlegend: first, line: { color: at.color, width: 1.2, dash: at.dash }, text: rows.map(() => safe(table.names[life[last]])),
        marker: { color: at.color, size: rows.map((row) => (row === last && !failed[last] ? 9 : 3)), symbol: rows.map((row) => (row === last && !failed[last] ? "x" : "circle")) },
        hovertemplate: "%{text}: %{x:.4~g}, %{y:.4~g}<extra></extra>",
      };
    });
    const n_failed = rows_of.filter((rows) => rows.length && failed[rows[0]]).length;
    say("lives", rows_of.filter((rows) => rows.length).length + " lives, of which " + n_failed + " end in failure");
    const title = selected("lives", "quantity");
    draw("lives", traces, { xaxis: { title: { text: values.relative ? "share of the life" : "time since new, h" } }, yaxis: { title: { text: title }, rangemode: "tozero" } }, title + " over the time of each life");
  }

  function draw_beside() {
    const rows = [...DATA.beside].reverse(), names = rows.map((one) => safe(one.name).replace(".", "<br>").replace(", ", "<br>")), x = [], y = [];
    const highest = 1.3 * Math.max(...rows.flatMap((one) => [one.p95, one.high || 0, one.low || 0]));
    rows.forEach((one, i) => { x.push(one.low || 0, one.high === null ? highest : one.high, null); y.push(i + 0.15, i + 0.15, null); });
    say("beside", rows.map((one) => one.name + ": " + one.verdict).reverse().join("; "));
    draw("beside", [
      { x, y, mode: "lines", name: "measured", line: { color: "#E69F00", width: 9 }, hoverinfo: "x" },
      { x: rows.map((one) => one.median), y: rows.map((_, i) => i - 0.15), mode: "markers", name: "this set, 5 to 95 %", marker: { color: dark.matches ? "#56B4E9" : "#0072B2", size: 9 },
        error_x: { type: "data", symmetric: false, array: rows.map((one) => one.p95 - one.median), arrayminus: rows.map((one) => one.median - one.p5), thickness: 2.5 } },
    ], { xaxis: { title: { text: "value" }, range: [0, highest] }, yaxis: { tickvals: rows.map((_, i) => i), ticktext: names, range: [-0.6, rows.length - 0.4] } }, "Measured ranges beside this set");
  }

  const DRAWERS = { signals: draw_signals, parameters: draw_parameters, indicators: draw_indicators, lives: draw_lives, beside: draw_beside };
  const present = Object.entries(DRAWERS).filter(([name]) => document.getElementById(name + "-controls"));
  for (const [name, drawer] of present) {
    const form = document.getElementById(name + "-controls");
    form.addEventListener("change", drawer);
    form.addEventListener("submit", (event) => event.preventDefault());
    drawer();
  }
  dark.addEventListener("change", () => present.forEach(([, drawer]) => drawer()));
})();
