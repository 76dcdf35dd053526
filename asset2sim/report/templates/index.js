// The list of objects: filters, search, sort, and the address that keeps them. The data are columns in the page.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const form = document.getElementById("filters");
const list = document.getElementById("list");
const more = document.getElementById("more");
const count = document.getElementById("count");
const total = data.id.length;
const PAGE = 60; // cards that are added at once: a screen needs twenty
const CODED = ["category", "mode", "support", "method"];
const NUMBERS = ["size", "mass", "effort", "phi", "seconds", "cost"];
const SECTIONS = new Set(["objects", "failures", "figures", "history", "main"]);
const ok = data.words.mode.indexOf("none");
const texts = data.id.map((id, i) =>
  [id, data.words.category[data.category[i]], data.words.mode[data.mode[i]], data.prompt[i], data.reason[i]].join("\n").toLowerCase());

let found = [];
let shown = 0;

for (const name of CODED) {
  const counts = new Map();
  for (const code of data[name]) counts.set(code, (counts.get(code) || 0) + 1);
  form.elements[name].append(new Option("all", ""));
  data.words[name].forEach((word, code) => {
    if (name === "mode" && code === ok) return;
    form.elements[name].append(new Option(`${word} (${counts.get(code)})`, word));
  });
}

function chosen() {
  return Object.fromEntries([...new FormData(form)].filter(([, value]) => value !== ""));
}

function matching(wanted) {
  const tests = [];
  for (const name of CODED) {
    if (!(name in wanted)) continue;
    const code = data.words[name].indexOf(wanted[name]);
    tests.push(i => data[name][i] === code);
  }
  if (wanted.status === "ok") tests.push(i => data.mode[i] === ok);
  if (wanted.status === "failed") tests.push(i => data.mode[i] !== ok);
  if (wanted.status === "new") tests.push(i => data.change[i] === 1);
  if (wanted.status === "mended") tests.push(i => data.change[i] === 2);
  for (const word of (wanted.q || "").toLowerCase().split(/\s+/).filter(Boolean)) tests.push(i => texts[i].includes(word));
  const result = [];
  for (let i = 0; i < total; i++) if (tests.every(test => test(i))) result.push(i);
  return result;
}

function sorted(rows, by, order) {
  const ids = new Intl.Collator("en", { numeric: true });
  const way = order === "down" ? -1 : 1;
  const byId = (a, b) => ids.compare(data.id[a], data.id[b]);
  const values = NUMBERS.includes(by) ? data[by] : null;
  const compare = {
    id: byId,
    category: (a, b) => data.category[a] - data.category[b] || byId(a, b),
    "": (a, b) => (data.mode[a] === ok) - (data.mode[b] === ok) || (data.change[b] === 1) - (data.change[a] === 1) || byId(a, b),
  }[by];
  return rows.sort((a, b) => {
    if (!values) return way * compare(a, b);
    if (values[a] === null || values[b] === null) return (values[a] === null) - (values[b] === null); // unknown comes last
    return way * (values[a] - values[b]) || byId(a, b);
  });
}

function element(tag, name, text) {
  const made = document.createElement(tag);
  made.className = name;
  if (text) made.textContent = text;
  return made;
}

function figure(value, unit) {
  return value === null ? null : `${value} ${unit}`;
}

function card(i) {
  const item = document.createElement("li");
  const link = element("a", "");
  link.href = `objects/${encodeURIComponent(data.id[i])}/index.html`;
  if (data.picture[i]) {
    const image = new Image(72, 72);
    image.loading = "lazy";
    image.alt = "";
    image.onerror = () => image.replaceWith(element("span", "blank", "no picture")); // the index was sent alone
    image.src = `objects/${encodeURIComponent(data.id[i])}/thumb.webp`;
    link.append(image);
  } else {
    link.append(element("span", "blank", "no picture"));
  }
  const passes = data.mode[i] === ok;
  const name = element("span", "name", data.id[i]);
  name.append(element("span", `badge ${passes ? "ok" : "fail"}`, passes ? "pass" : data.words.mode[data.mode[i]]));
  const what = [data.words.category[data.category[i]], data.words.support[data.support[i]]];
  if (data.words.method.length > 1) what.push(data.words.method[data.method[i]]);
  if (data.change[i]) what.push(data.change[i] === 1 ? "new failure" : "mended");
  const force = data.effort[i] === null ? null : `opens at ${data.effort[i] < 0.01 ? "< 0.01" : data.effort[i]} N`;
  const numbers = [figure(data.size[i], "m"), figure(data.mass[i], "kg"), force];
  link.append(name, element("span", "line", what.join(" · ")), element("span", "line", numbers.filter(Boolean).join(" · ")));
  if (data.reason[i]) link.append(element("span", "reason", data.reason[i]));
  item.append(link);
  return item;
}

function showMore() {
  const next = found.slice(shown, shown + PAGE);
  list.append(...next.map(card));
  shown += next.length;
  more.hidden = shown >= found.length;
}

function update() {
  const wanted = chosen();
  found = sorted(matching(wanted), wanted.sort || "", wanted.order);
  list.replaceChildren();
  shown = 0;
  showMore();
  count.textContent = found.length === total ? `${total} objects` : `${found.length} of ${total} objects`;
}

function keepInAddress() {
  history.replaceState(null, "", `#${new URLSearchParams(chosen())}`);
}

function fromAddress() {
  const hash = location.hash.slice(1);
  if (SECTIONS.has(hash)) return;
  const wanted = new URLSearchParams(hash);
  for (const field of form.elements) if (field.name) field.value = wanted.get(field.name) || "";
  for (const field of form.elements) if (field.tagName === "SELECT" && field.selectedIndex < 0) field.value = "";
  update();
  if (hash) document.getElementById("objects").scrollIntoView();
}

form.addEventListener("input", () => { update(); keepInAddress(); });
form.addEventListener("submit", event => event.preventDefault());
form.addEventListener("reset", () => setTimeout(() => { update(); keepInAddress(); }));
more.addEventListener("click", showMore);
addEventListener("hashchange", fromAddress);
new IntersectionObserver(entries => { if (entries[0].isIntersecting && !more.hidden) showMore(); }, { rootMargin: "600px" }).observe(more);
update();
fromAddress();
