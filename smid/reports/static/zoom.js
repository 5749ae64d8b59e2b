"use strict";
// The figures over time of a page, redrawn so that they can be zoomed. The picture stays for paper.
(() => {
  const UNITS = [[86400, "d"], [3600, "h"], [60, "min"]]; // a span of three of them is told in it
  const mixed = (look, own) => (look.alpha < 1 ? `color-mix(in srgb, ${own} ${100 * look.alpha}%, transparent)` : own);
  const styled = (look) => mixed(look, look.colour.startsWith("--") ? `var(${look.colour})` : look.colour);
  const colour = (look) => { // as a canvas takes it, which knows no variables
    const own = getComputedStyle(document.documentElement).getPropertyValue(look.colour).trim();
    return mixed(look, own || look.colour);
  };
  const width = ({ min, max }) => max - min;
  const rounded = (value, span) => // to what can be seen of it
    String(+value.toFixed(Math.min(Math.max(3 - Math.floor(Math.log10(span)), 0), 20)));
  const seen = (plot) => UNITS.find(([seconds]) => width(plot.scales.x) >= 3 * seconds) || [1, "s"];
  const instant = (plot, time) => {
    const [seconds, name] = seen(plot);
    return time === null ? "" : `${rounded(time / seconds, width(plot.scales.x) / seconds)} ${name}`;
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
    value: (plot, value) => (value === null ? "" : rounded(value, width(plot.scales.y))),
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

  const options = (panel, data, key, room) => {
    const first = panel === data.panels[0], last = panel === data.panels.at(-1), alone = panel.traces.length === 1;
    const bands = [], looks = [null], all = [{ label: "time", class: first ? "named" : "unnamed", value: instant }];
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
    const steps = Array.from({ length: 54 }, (_, k) => [1, 2, 5][k % 3] * 10 ** (Math.floor(k / 3) - 9));
    return {
      width: 300, height: last ? 200 : 150, series: all, bands, padding: [8, 12, 0, 0],
      scales: { x: { time: false } },
      legend: { markers: { width: 0, fill: (_, k) => looks[k] && styled(looks[k]) } },
      cursor: { y: false, sync: { key }, drag: { x: true, y: false }, points: { size: 5 } },
      axes: [
        { ...axis, size: last ? 28 : 8, labelSize: 22, label: last ? (plot) => `${data.label} [${seen(plot)[1]}]` : undefined,
          incrs: (plot) => steps.map((one) => one * seen(plot)[0]),
          values: (plot, splits) => splits.map((time) => (last ? String(+(time / seen(plot)[0]).toPrecision(10)) : "")) },
        { ...axis, labelSize: 20, label: panel.label, size: (_, values) => room(values || []),
          values: (_, splits) => splits.map((value) => String(+value.toPrecision(10))) },
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
    const time = Array.from({ length: data.points }, (_, k) => data.start + k * data.step), end = time.at(-1);
    let widest = 44; // pixels of the numbers at the left; all plots leave as many, so that their times are in line
    const room = (values) => {
      const wanted = 14 + 7 * Math.max(0, ...values.map((text) => text.length));
      if (wanted > widest) queueMicrotask(() => plots.forEach((plot) => plot.redraw(false, true)));
      return (widest = Math.max(widest, wanted));
    };
    const plots = data.panels.map((panel, k) => {
      const place = box.appendChild(document.createElement("div"));
      place.role = "img"; place.ariaLabel = `${panel.label} over time`;
      return new uPlot(options(panel, data, `figure-${number}`, room), [time, ...rows[k].map((row) => unpacked(row, data.points))], place);
    });
    const span = (from, to) => {
      const length = Math.min(Math.max(to - from, 4 * data.step), end - data.start);
      const left = Math.min(Math.max(from, data.start), end - length);
      plots.forEach((plot) => plot.setScale("x", { min: left, max: left + length }));
    };
    const by = (near, far) => () => { // in shares of the span shown
      const { min, max } = plots[0].scales.x;
      span(min + near * (max - min), max + far * (max - min));
    };
    for (const [text, name, act] of [
      ["Whole record", "Whole record", () => span(data.start, end)], ["+", "Zoom in", by(0.25, -0.25)], ["\u2212", "Zoom out", by(-0.5, 0.5)],
      ["\u2190", "Left", by(-0.5, -0.5)], ["\u2192", "Right", by(0.5, 0.5)],
    ]) {
      const button = bar.appendChild(document.createElement("button"));
      Object.assign(button, { type: "button", textContent: text, title: name, ariaLabel: name, onclick: act });
    }
    const shown = bar.appendChild(document.createElement("output"));
    plots[0].hooks.setScale = [(plot) => (shown.value = `${instant(plot, plot.scales.x.min)} to ${instant(plot, plot.scales.x.max)}`)];
    const help = box.appendChild(document.createElement("p"));
    help.className = shown.className = "soft";
    help.textContent = `${data.note}Drag over a plot to zoom; double click for the whole record.`;
    const fit = () => box.clientWidth && plots.forEach((plot) => plot.setSize({ width: box.clientWidth, height: plot.height }));
    new ResizeObserver(fit).observe(box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plots.forEach((plot) => plot.redraw(false)));
  };
  document.querySelectorAll("script.traces").forEach(start);
})();
