"use strict";
// The figures over time of a page, redrawn so that they can be zoomed. The picture stays for paper.
(() => {
  const UNITS = [[86400, "d"], [3600, "h"], [60, "min"]]; // a span of three of them is told in it
  const colour = (look) => {
    const name = look.colour;
    const own = name.startsWith("--") ? getComputedStyle(document.documentElement).getPropertyValue(name).trim() : name;
    return look.alpha < 1 ? `color-mix(in srgb, ${own} ${100 * look.alpha}%, transparent)` : own;
  };
  const unit = (span) => UNITS.find(([seconds]) => span >= 3 * seconds) || [1, "s"];
  const spanned = (plot) => plot.scales.x.max - plot.scales.x.min;
  const seen = (plot) => unit(spanned(plot));
  const instant = (plot, time) => {
    const [seconds, name] = seen(plot), places = Math.max(3 - Math.floor(Math.log10(spanned(plot) / seconds)), 0);
    return `${+(time / seconds).toFixed(places)} ${name}`;
  };

  const unpacked = ([offset, text], count) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const found = Array.from(new Float32Array(bytes.buffer), (value) => (isNaN(value) ? null : offset + value));
    return found.length > 1 ? found : Array(count).fill(found[0]); // one number: a level
  };

  // In the legend a line has its value at the cursor, and a band, of two edges without a stroke, only its name.
  const series = (trace, label, row) => ({
    label,
    class: row || !label ? "unnamed" : trace.width === undefined ? "plain" : "named",
    stroke: () => colour(trace),
    width: trace.width || 0,
    dash: trace.dash,
    value: (_, value) => (value === null ? "" : String(+value.toPrecision(5))),
    paths: trace.steps ? uPlot.paths.stepped({ align: 1 }) : trace.width === 0 ? () => null : undefined,
    points: { show: trace.dots > 0 || undefined, size: trace.dots || 3, fill: () => colour(trace), width: 0 },
  });

  const shade = (plot, shades) => {
    for (const [from, to, look] of shades) {
      const [left, right] = [from, to].map((time) => plot.valToPos(time, "x", true));
      plot.ctx.fillStyle = colour(look);
      plot.ctx.fillRect(left, plot.bbox.top, Math.max(right - left, 1), plot.bbox.height);
    }
  };

  const options = (panel, data, key, width, last) => {
    const first = panel === data.panels[0], alone = panel.traces.length === 1;
    const told = (plot, time) => (time === null ? "" : instant(plot, time));
    const bands = [], looks = [null], all = [{ label: "time", class: first ? "named" : "unnamed", value: told }];
    for (const trace of panel.traces) {
      if (trace.rows.length > 1) bands.push({ series: [all.length + 1, all.length], fill: () => colour(trace) });
      trace.rows.forEach((_, row) => {
        all.push(series(trace, trace.label || (alone ? panel.label : ""), row));
        looks.push(trace);
      });
    }
    const axis = {
      stroke: () => colour({ colour: "--ink" }), font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif",
      grid: { stroke: () => colour({ colour: "--grid" }), width: 0.5 }, ticks: { show: false },
    };
    const steps = [1, 2, 5].flatMap((one) => Array.from({ length: 18 }, (_, power) => one * 10 ** (power - 9))).sort((a, b) => a - b);
    return {
      width, height: last ? 200 : 150, series: all, bands, padding: [8, 12, 0, 0],
      scales: { x: { time: false } },
      legend: { markers: { width: 0, fill: (_, k) => looks[k] && colour(looks[k]) } },
      cursor: { sync: { key }, drag: { x: true, y: false }, points: { size: 5 } },
      axes: [
        { ...axis, size: last ? 28 : 8, labelSize: 22, label: last ? (plot) => `${data.label} [${seen(plot)[1]}]` : undefined,
          incrs: (plot) => steps.map((one) => one * seen(plot)[0]),
          values: (plot, splits) => splits.map((time) => (last ? String(+(time / seen(plot)[0]).toPrecision(10)) : "")) },
        { ...axis, size: 44, labelSize: 20, label: panel.label },
      ],
      hooks: { drawClear: [(plot) => shade(plot, panel.shades)] },
    };
  };

  const start = (source, number) => {
    const figure = source.parentElement, data = JSON.parse(source.textContent);
    const box = document.createElement("div"), bar = box.appendChild(document.createElement("div"));
    box.className = "zoom"; bar.className = "bar"; bar.role = "group"; bar.ariaLabel = "Zoom";
    figure.insertBefore(box, figure.querySelector("figcaption"));
    if (data.whole) figure.classList.add("live");
    const rows = data.panels.map((panel) => panel.traces.flatMap((trace) => trace.rows));
    const time = Array.from({ length: data.points }, (_, k) => data.start + k * data.step);
    const ends = [time[0], time[data.points - 1]];
    const shown = document.createElement("output");
    shown.className = "soft";
    const plots = data.panels.map((panel, k) => {
      const place = box.appendChild(document.createElement("div"));
      place.role = "img"; place.ariaLabel = `${panel.label} over time`;
      const last = k === data.panels.length - 1;
      const made = options(panel, data, `figure-${number}`, box.clientWidth || 300, last);
      return new uPlot(made, [time, ...rows[k].map((row) => unpacked(row, data.points))], place);
    });
    const span = (from, to) => {
      const width = Math.min(Math.max(to - from, 4 * data.step), ends[1] - ends[0]);
      const left = Math.min(Math.max(from, ends[0]), ends[1] - width);
      plots.forEach((plot) => plot.setScale("x", { min: left, max: left + width }));
    };
    const by = (near, far) => () => { // in shares of the span shown
      const { min, max } = plots[0].scales.x;
      span(min + near * (max - min), max + far * (max - min));
    };
    for (const [text, name, act] of [
      ["Whole record", "", () => span(...ends)], ["+", "Zoom in", by(0.25, -0.25)], ["\u2212", "Zoom out", by(-0.5, 0.5)],
      ["\u2190", "Left", by(-0.5, -0.5)], ["\u2192", "Right", by(0.5, 0.5)],
    ]) {
      const button = bar.appendChild(document.createElement("button"));
      Object.assign(button, { type: "button", textContent: text, title: name, onclick: act });
      if (name) button.ariaLabel = name;
    }
    bar.append(shown);
    const tell = (plot) => (shown.value = [plot.scales.x.min, plot.scales.x.max].map((end) => instant(plot, end)).join(" to "));
    plots[0].hooks.setScale = [tell];
    const help = box.appendChild(document.createElement("p"));
    help.className = "soft"; help.textContent = `${data.note}Drag over a plot to zoom; double click for the whole record.`;
    new ResizeObserver(() => box.clientWidth && plots.forEach((plot) => plot.setSize({ width: box.clientWidth, height: plot.height }))).observe(box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plots.forEach((plot) => plot.redraw(false)));
  };
  document.querySelectorAll("script.traces").forEach(start);
})();
