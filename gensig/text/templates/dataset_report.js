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
  // Of every chart. The library's bar of tools has a button that sends the chart to a cloud service; no chart has the bar.
  const CONFIG = { displayModeBar: false, showSendToCloud: false, plotlyServerURL: "", responsive: true, scrollZoom: false };
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
      margin: { l: 60, r: 12, t: 12, b: 44 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: ink, size: 12 }, legend: { orientation: "h", yref: "container", y: 0, yanchor: "bottom", x: 0 }, hovermode: "closest",
      dragmode: coarse.matches ? false : "zoom", ...layout,
      xaxis: { ...axis, ...layout.xaxis },
      yaxis: { ...axis, ...layout.yaxis },
    };
    if (full.yaxis.type === "log") full.yaxis.exponentformat = "power";
    if (layout.yaxis2) full.yaxis2 = { ...axis, ...layout.yaxis2 };
    node.setAttribute("aria-label", what);
    Plotly.react(node, traces, full, CONFIG);
  }

  // ---- signals -------------------------------------------------------------------------------------------------
  const is_twin = (record) => record.class === "healthy twin";

  function short_name(record) {
    if (is_twin(record)) return "healthy twin of " + record.record;
    const other = record.condition === record.of ? "" : ", of another condition";
    return record.class + ", severity " + short(record.severity) + ", " + record.record + other;
  }

  // Only records of the same condition can be compared; the healthy one is chosen first.
  function offer_others(record) {
    const field = document.getElementById("signals-controls").elements.other;
    const options = [["", "nothing"], ...record.compare.map((k) => [String(k), short_name(DATA.examples[k])])];
    field.replaceChildren(...options.map(([value, text]) => {
      const option = document.createElement("option");
      option.value = value;
      option.textContent = text;
      return option;
    }));
    field.value = record.healthy === null ? "" : String(record.healthy);
  }

  function name_of(record) {
    const f = record.frequencies, parts = [short_name(record), record.unit];
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

  // Averaged turns of a gear above, and their difference below.
  function draw_turns(plot, pair, teeth, gear, tooth, of, what) {
    const at = (packed) => ramp(packed.length, 0, teeth / packed.length, 1);
    const blue = dark.matches ? "#56B4E9" : "#0072B2", red = dark.matches ? "#E69F00" : "#D55E00";
    const colors = pair.length > 1 ? ["#7F7F7F", blue] : [blue];
    const lines = pair.map((one) => wave(one.packed));
    const traces = pair.map((one, i) => ({
      x: at(lines[i]), y: lines[i], mode: "lines", name: one.label, line: { color: colors[i], width: 1.2 },
    }));
    const layout = {
      xaxis: { title: { text: "tooth of the " + safe(gear) }, range: [0, teeth], anchor: "y" },
      yaxis: { title: { text: safe(of.name) + ", " + unit(of.unit) } },
    };
    if (pair.length > 1) {
      const difference = lines[1].map((y, i) => y - lines[0][i]);
      traces.push({ x: at(difference), y: difference, mode: "lines", name: "difference", yaxis: "y2", line: { color: red, width: 1.2 } });
      Object.assign(layout.yaxis, { domain: [0.44, 1] });
      layout.yaxis2 = { domain: [0, 0.36] };
      layout.xaxis.anchor = "y2";
    }
    if (tooth !== null) {
      layout.shapes = [{ type: "rect", xref: "x", yref: "paper", x0: tooth, x1: tooth + 1, y0: 0, y1: 1, fillcolor: red, opacity: 0.15, line: { width: 0 }, layer: "below" }];
    }
    draw(plot, traces, layout, what);
  }

  function draw_averaged_turn(record, beside, channel) {
    const gear = record.turned, mine = record.turns[gear], of = DATA.channels[channel];
    const part = (one) => ({ packed: one.turns[gear].channels[channel], label: safe(short_name(one)) });
    if (!mine) return draw("turn", [], { annotations: [note("no whole turn of a known gear")] }, "No averaged turn");
    const pair = beside && beside.turns[gear] ? [part(beside), part(record)] : [part(record)];
    const tooth = mine.from_tooth_0 ? record.tooth : null;
    draw_turns("turn", pair, mine.teeth, gear, tooth, of, "Averaged turn of the " + gear + " over " + mine.n_turns + " turns: " + pair.map((one) => one.label).join("; beside "));
  }

  function turns_in(record) {
    const mine = record.turns[record.turned];
    return mine ? ". Averaged over " + mine.n_turns + (mine.n_turns === 1 ? " turn" : " turns") + " of the " + record.turned : "";
  }

  const note = (text) => ({ text, showarrow: false, xref: "paper", yref: "paper", x: 0.5, y: 0.5 });

  function set_sound(name, record) {
    const player = document.getElementById("sound-" + name), said = document.getElementById("sound-" + name + "-said");
    player.parentNode.hidden = !record;
    if (!record || player.getAttribute("src") === record.sound) return;
    player.setAttribute("src", record.sound);
    said.textContent = "Sound of " + short_name(record) + " (" + DATA.channels[DATA.first_channel].name + ")";
    player.setAttribute("aria-label", said.textContent);
  }

  let offered = DATA.opening;
  function draw_signals() {
    const record_number = Number(chosen("signals").record);
    if (record_number !== offered) offer_others(DATA.examples[record_number]);
    offered = record_number;
    const values = chosen("signals"), record = DATA.examples[record_number], channel = Number(values.channel), view = record.views[channel];
    const beside = values.other === "" ? undefined : DATA.examples[Number(values.other)];
    const of_healthy = values.other !== "" && Number(values.other) === record.healthy ? " (" + record.beside + ")" : "";
    set_sound("record", record);
    set_sound("other", beside);
    draw_averaged_turn(record, beside, channel);
    const reference = values.axis === "hz" ? null : record.frequencies[values.axis];
    const label = (one) => safe(short_name(one));
    const shown = beside ? [{ record: beside, view: beside.views[channel], label: label(beside), color: "#7F7F7F" }] : [];
    shown.push({ record, view, label: label(record), color: dark.matches ? "#56B4E9" : "#0072B2" });
    const orders = values.axis === "mesh" ? "orders of the mesh" : "orders of the " + (values.axis === "drive" ? "driving shaft" : values.axis);
    const frequency_title = reference ? orders : "frequency, Hz", factor = reference ? 1 / reference : 1;
    const time_title = reference ? (values.axis === "mesh" ? "meshes" : "turns") + (values.axis === "mesh" ? "" : " of the " + (values.axis === "drive" ? "driving shaft" : values.axis)) : "time, ms";
    const of = DATA.channels[channel], amplitude_title = "amplitude, " + unit(of.unit);
    say("signals", of.name + ": " + name_of(record) + (beside ? ". Grey: " + name_of(beside) + of_healthy : "") + turns_in(record) + (record.healthy === null && record.severity > 0 ? ". There is no healthy signal of its condition" : "") + ".");

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

  // ---- severity ------------------------------------------------------------------------------------------------
  function draw_severity() {
    const form = document.getElementById("severity-controls"), slider = form.elements.step;
    const sweep = DATA.severity[Number(chosen("severity").class)], of = DATA.channels[DATA.first_channel];
    slider.max = String(sweep.steps.length - 1);
    const number = Number(slider.value), step = sweep.steps[number];
    slider.setAttribute("aria-valuetext", step.label);
    say("severity", sweep.class + ", " + step.label + ", " + step.record + " (" + (number + 1) + " of " + sweep.steps.length + "). Grey: " + step.beside);
    if (step.turns.length === 2) {
      const [mine, healthy] = step.turns;
      const pair = [{ packed: healthy.channels[0], label: "healthy" }, { packed: mine.channels[0], label: safe(step.label) }];
      draw_turns("step_turn", pair, mine.teeth, sweep.gear, mine.from_tooth_0 ? step.tooth : null, of, "Averaged turn at " + step.label);
    } else {
      draw("step_turn", [], { annotations: [note("no averaged turn")] }, "No averaged turn");
    }
    draw_change(sweep, number);
    if (document.getElementById("plot-step_wave")) draw_step_wave(step, of);
  }

  function draw_change(sweep, number) {
    const known = sweep.steps.filter((step) => step.change !== null), at = sweep.steps[number], blue = style(0).color;
    const points = { x: known.map((step) => step.severity), y: known.map((step) => step.change), text: known.map((step) => safe(step.label)) };
    const traces = [{ ...points, mode: "lines+markers", name: "records", line: { color: blue, width: 1 }, hovertemplate: "%{text}: %{y:.3~g}<extra></extra>" }];
    if (at.change !== null) {
      traces.push({ x: [at.severity], y: [at.change], mode: "markers", name: "shown", marker: { color: style(1).color, size: 13, symbol: "circle-open", line: { width: 3 } }, hoverinfo: "skip" });
    }
    draw("step_change", traces, { xaxis: { title: { text: "severity" } }, yaxis: { title: { text: "change" }, rangemode: "tozero" } }, "Change of the averaged turn over severity, " + sweep.class);
  }

  function draw_step_wave(step, of) {
    if (!step.wave) return draw("step_wave", [], { annotations: [note("no twin")] }, "No twin");
    const y = wave(step.wave);
    const trace = { x: ramp(y.length, 0, step.wave.step, 1e3), y, mode: "lines", name: "record minus twin", line: { color: style(1).color, width: 1 } };
    draw("step_wave", [trace], { xaxis: { title: { text: "time, ms" } }, yaxis: { title: { text: safe(of.name) + ", " + unit(of.unit) } } }, "Record minus its healthy twin at " + step.label);
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

  const DRAWERS = { signals: draw_signals, severity: draw_severity, parameters: draw_parameters, indicators: draw_indicators, lives: draw_lives, beside: draw_beside };
  const present = Object.entries(DRAWERS).filter(([name]) => document.getElementById(name + "-controls"));
  for (const [name, drawer] of present) {
    const form = document.getElementById(name + "-controls");
    form.addEventListener("change", drawer);
    form.querySelectorAll("input[type=range]").forEach((slider) => slider.addEventListener("input", drawer));
    form.addEventListener("submit", (event) => event.preventDefault());
    drawer();
  }
  dark.addEventListener("change", () => present.forEach(([, drawer]) => drawer()));
})();
