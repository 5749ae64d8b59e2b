// The page of `smid app`: sends forms, shows what the server answers. All text is set as text; only the answers of this
// server, which are made as the reports are, are set as HTML.
"use strict";

const STEPS = ["data", "channels", "model", "least", "intervals", "misfit", "cause"];
const QUIET = 5000; // milliseconds between two lines of progress that a screen reader says
const part = (kind, step) => document.getElementById(`${kind}-${step}`);
const say = words => { document.getElementById("status").textContent = words; };
let busy = false;

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

function fail(step, words) {
  part("error", step).hidden = !words;
  part("error", step).textContent = words;
  if (words) say("");
  // The error of a file names an option.
  if (words && step === "data") document.getElementById("reading").open = true;
}

// A step that begins takes back what it and the steps below have shown.
function clear(step) {
  for (const later of STEPS.slice(STEPS.indexOf(step))) {
    for (const kind of ["answer", "files"]) part(kind, later).replaceChildren();
    part("python", later).hidden = part("doing", later).hidden = true;
    fail(later, "");
  }
  document.getElementById("extend").hidden = true;
}

function allFields() {
  const fields = new URLSearchParams();
  for (const form of document.forms) {
    // A disabled set has no fields: open it while they are read.
    const set = form.querySelector("fieldset"), closed = set.disabled;
    set.disabled = false;
    for (const [name, value] of new FormData(form)) if (typeof value === "string") fields.append(name, value);
    set.disabled = closed;
  }
  return fields;
}

async function run(step) {
  if (busy) return;
  busy = true;
  document.body.classList.add("busy");
  clear(step);
  const began = performance.now(), doing = part("doing", step), bar = doing.querySelector("progress");
  const stop = document.querySelector(`.stop[data-step=${step}]`);
  let said = began, last = null;
  bar.removeAttribute("value");
  doing.querySelector("span").textContent = "working";
  doing.hidden = bar.hidden = stop.hidden = false;
  say("working");
  try {
    const answer = await fetch(`run/${step}`, { method: "POST", body: allFields() });
    if (!answer.ok) throw new Error((await answer.json()).error);
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    let rest = "";
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      const lines = (rest + value).split("\n");
      rest = lines.pop();
      for (const event of lines.map(JSON.parse)) {
        if ("code" in event) showCode(step, event.code);
        else if ("line" in event) {
          doing.querySelector("span").textContent = event.line;
          if (event.total) { bar.max = event.total; bar.value = event.done; } else bar.removeAttribute("value");
          if (performance.now() - said > QUIET) { say(event.line); said = performance.now(); }
        } else last = event;
      }
    }
    if (!last) throw new Error("smid app has ended: start it again");
    show(step, last);
    doing.querySelector("span").textContent = `done in ${((performance.now() - began) / 1000).toFixed(1)} s`;
    if (!last.error) say(doing.textContent.trim());
  } catch (error) {
    fail(step, error instanceof TypeError ? "smid app does not answer: start it again" : error.message);
  } finally {
    busy = false;
    document.body.classList.remove("busy");
    // The keyboard stays where it was, although the button to stop is gone.
    if (document.activeElement === stop) document.querySelector(`button[value=${step}]`).focus();
    bar.hidden = stop.hidden = true;
    doing.hidden = !part("error", step).hidden;
  }
}

function showCode(step, code) {
  part("python", step).hidden = false;
  part("python", step).querySelector("code").textContent = code;
}

function show(step, { error, answer, names, files }) {
  fail(step, error);
  for (const set of document.querySelectorAll("fieldset[data-needs]")) set.disabled = !names.includes(set.dataset.needs);
  const made = { data: "overview", channels: "record", model: "model", intervals: "estimate", misfit: "run", cause: "diagnosis" };
  for (const [name, product] of Object.entries(made))
    document.querySelector(`.steps a[href="#step-${name}"]`).classList.toggle("done", names.includes(product));
  document.getElementById("script").hidden = !names.length;
  part("files", step).replaceChildren(...files.map(([file, words]) =>
    element("a", { class: "file", href: `download/${file}`, download: file }, `${words}: ${file}`)));
  if (!answer) return;
  part("answer", step).innerHTML = answer.html;
  if (step === "data") askRoles(answer.channels);
  if (step === "model") askBounds(answer.noisy);
  for (const [name, value] of Object.entries(answer.values)) {
    const input = document.getElementById(name);
    if (input && !(name === "toml" && input.dataset.edited)) input.value = value;
  }
  const extend = document.getElementById("extend");
  extend.hidden = !answer.values.extended;
  extend.onclick = () => takeModel(answer.values.extended);
}

function askRoles(channels) {
  const before = Object.fromEntries([...document.querySelectorAll("#roles select")].map(s => [s.name, s.value]));
  document.getElementById("roles").replaceChildren(...channels.map(([name, words], k) => {
    const select = element("select", { id: `role-${k}`, name: `role:${name}` });
    for (const [value, text] of [["", "not used"], ["input", "input"], ["output", "output"], ["further", "may act"]])
      select.append(new Option(text, value, false, before[`role:${name}`] === value));
    return element("div", { class: "field" }, element("label", { for: select.id }, words), select);
  }));
}

function askBounds(noisy) {
  const before = Object.fromEntries([...document.querySelectorAll("#bounds input")].map(i => [i.name, i.value]));
  document.getElementById("bounds").replaceChildren(...noisy.map(([name, unit]) => {
    const id = `bound:${name}`, words = `Noise bound of ${name}${unit ? ` [${unit}]` : ""}`;
    const input = element("input", { type: "number", step: "any", min: "0", id, name: id, autocomplete: "off" });
    input.value = before[id] ?? "";
    return element("div", { class: "field" }, element("label", { for: id }, words), input);
  }));
}

function takeModel(text) {
  document.getElementById("toml").value = text;
  document.getElementById("toml").dataset.edited = "yes";
  document.getElementById("class").value = "file";
  showClass();
  document.getElementById("toml").focus();
}

function showClass() {
  const chosen = document.getElementById("class").value;
  for (const one of document.querySelectorAll(".of-class")) one.hidden = !one.dataset.class.split(" ").includes(chosen);
}

async function take(file) {
  if (busy || !file) return;
  clear("data");
  say(`reading ${file.name}`);
  try {
    const answer = await fetch(`file?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
    const content = await answer.json();
    if (!answer.ok) throw new Error(content.error);
    document.getElementById("file-name").value = content.file;
    document.getElementById("bundled").value = "";
  } catch (error) {
    const why = "it is too large, or smid app has ended";
    fail("data", error instanceof TypeError ? `${file.name} did not arrive: ${why}` : error.message);
    return;
  }
  await run("data");
}

const drop = document.getElementById("drop");
// A file that misses the field must not replace the page.
for (const name of ["dragover", "drop"]) window.addEventListener(name, event => event.preventDefault());
drop.addEventListener("dragover", () => drop.classList.add("over"));
drop.addEventListener("dragleave", () => drop.classList.remove("over"));
window.addEventListener("drop", event => { drop.classList.remove("over"); take(event.dataTransfer.files[0]); });
// The same file, changed on disk, can be chosen again.
document.getElementById("file").addEventListener("click", event => { event.target.value = ""; });
document.getElementById("file").addEventListener("change", event => take(event.target.files[0]));
document.getElementById("bundled").addEventListener("change", () => {
  document.getElementById("file").value = document.getElementById("file-name").value = "";
});
document.getElementById("class").addEventListener("change", showClass);
document.getElementById("toml").addEventListener("input", event => { event.target.dataset.edited = "yes"; });
for (const form of document.forms) form.addEventListener("submit", event => {
  event.preventDefault();
  run(event.submitter?.value || form.dataset.step);
});
for (const stop of document.querySelectorAll(".stop")) stop.addEventListener("click", () => {
  say("stopping");
  fetch("stop", { method: "POST" });
});
for (const copy of document.querySelectorAll(".copy")) copy.addEventListener("click", async () => {
  await navigator.clipboard.writeText(copy.closest(".python").querySelector("code").textContent);
  say("copied");
});
showClass();
