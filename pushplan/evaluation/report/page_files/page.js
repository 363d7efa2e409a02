"use strict";
// The page of a run: tables that sort, a matrix of scenarios and policies, the chosen episode.
const $ = (id) => document.getElementById(id);
const make = (tag, text = "", properties = {}) =>
  Object.assign(document.createElement(tag), { textContent: text }, properties);
const data = JSON.parse($("data").textContent);
const colourOf = (policy) => data.colours.policies[policy % data.colours.policies.length]; // as in the figures
const ROW = 28; // height of a row of the matrix [px], as in the style sheet

// ---- light and dark
const setTheme = (theme) => { document.documentElement.dataset.theme = theme; };
const isDark = () => (document.documentElement.dataset.theme
  ? document.documentElement.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches);
const switchTheme = () => setTheme(isDark() ? "light" : "dark");
$("theme").onclick = switchTheme;

// ---- small tables: a click on a heading sorts by the first number, or the text, of its cells
function compare(a, b) { // numbers before texts, nothing last
  if (a === b) return 0;
  if (a === null || a === "") return 1;
  if (b === null || b === "") return -1;
  if (typeof a === typeof b) return a < b ? -1 : 1;
  return typeof a === "number" ? -1 : 1;
}
function valueOf(cell) {
  const text = cell.firstChild ? cell.firstChild.textContent.trim() : "";
  const number = parseFloat(text.replace("−", "-"));
  return Number.isNaN(number) ? text : number;
}
function mark(heads, at, down) {
  heads.forEach((head, i) => (i === at ? head.setAttribute("aria-sort", down ? "descending" : "ascending")
    : head.removeAttribute("aria-sort")));
}
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    head.querySelector("button").onclick = () => {
      const down = head.getAttribute("aria-sort") !== "descending" && column > 0;
      const body = table.tBodies[0];
      const lines = [...body.rows].sort((x, y) => compare(valueOf(x.cells[column]), valueOf(y.cells[column])));
      if (down) lines.reverse();
      body.append(...lines);
      mark(heads, column, down);
    };
  });
}

// ---- scenarios: for each the index of the row of each policy
const scenarios = data.scenarios.map(([key, setting, seed]) =>
  ({ key, setting, seed, rows: new Array(data.policies.length).fill(-1), rank: 0, reasons: "" }));
data.rows.policy.forEach((policy, row) => {
  const one = scenarios[data.rows.scenario[row]];
  one.rows[policy] = row;
  one.rank = Math.max(one.rank, rank(row));
});
function rank(row) { return data.statuses[data.rows.status[row]] !== "done" ? 2 : data.rows.success[row] ? 0 : 1; }
const MARKS = ["", " ✗", " ⚠"];
const CLASSES = ["", "missed", "failed"];

// ---- the matrix: only the rows in sight are in the document
const state = { shown: [], sort: null, down: true, one: null, column: 0, chosen: "" }; // cursor, and job that is shown
for (const title of data.settings) $("setting").append(make("option", title));
for (const [name, heading] of data.measures) $("measure").append(make("option", heading, { value: name }));
const matrix = $("matrix");
const table = make("table");
const head = make("tr");
["scenario", ...data.policies].forEach((name, column) => {
  const cell = make("th", "", { scope: "col" });
  if (column > 0) {
    cell.className = "policy";
    cell.style.setProperty("--policy", colourOf(column - 1));
  }
  cell.append(make("button", name, { type: "button", onclick: () => sortBy(column - 1) }));
  head.append(cell);
});
table.append(make("thead"), make("tbody"));
table.tHead.append(head);
matrix.append(table);

function shownValue(row) {
  const value = data.rows.values[$("measure").value][row];
  return value === null || value === undefined ? null : value;
}
function sortBy(column) {
  state.down = state.sort === column ? !state.down : column >= 0;
  state.sort = column;
  filter();
}
function keep(one) {
  const setting = $("setting").selectedIndex - 1;
  if (setting >= 0 && one.setting !== setting) return false;
  const outcome = $("outcome").value;
  const ranks = one.rows.filter((row) => row >= 0).map(rank);
  if (outcome === "failed" && !ranks.includes(2)) return false;
  if (outcome === "missed" && !ranks.some((r) => r > 0)) return false;
  if (outcome === "differ" && new Set(ranks).size < 2) return false;
  const words = $("find").value.toLowerCase().split(/\s+/).filter(Boolean);
  if (!words.length) return true;
  const reasons = one.rows.filter((row) => row >= 0).map((row) => data.reasons[data.rows.reason[row]]);
  const text = `${one.key} ${data.settings[one.setting]} ${reasons.join(" ")}`.toLowerCase();
  return words.every((word) => text.includes(word) || word === String(one.seed));
}
function filter() {
  state.shown = scenarios.filter(keep);
  const { sort, down } = state;
  if (sort === null) state.shown.sort((a, b) => b.rank - a.rank || a.setting - b.setting || a.seed - b.seed);
  else {
    const of = (one) => (sort < 0 ? one.key : one.rows[sort] < 0 ? null : shownValue(one.rows[sort]));
    const keys = new Map(state.shown.map((one) => [one, of(one)]));
    state.shown.sort((a, b) => {
      const [x, y] = [keys.get(a), keys.get(b)];
      return x === null || y === null || !down ? compare(x, y) : compare(y, x);
    });
    mark([...head.cells], sort + 1, down);
  }
  $("count").textContent = `${state.shown.length} of ${scenarios.length} scenarios`;
  draw();
}
function draw() {
  const body = table.tBodies[0];
  const first = Math.max(0, Math.floor(matrix.scrollTop / ROW) - 5);
  const last = Math.min(state.shown.length, first + Math.ceil(matrix.clientHeight / ROW) + 12);
  const space = (count) => {
    const line = make("tr", "", { className: "space" });
    const cell = make("td", "", { colSpan: data.policies.length + 1 });
    cell.style.height = line.style.height = `${count * ROW}px`;
    line.append(cell);
    return line;
  };
  const lines = [];
  if (first > 0) lines.push(space(first));
  for (let i = first; i < last; i++) lines.push(line(state.shown[i]));
  if (last < state.shown.length) lines.push(space(state.shown.length - last));
  body.replaceChildren(...lines);
}
function line(one) {
  const found = make("tr");
  found.append(make("td", one.key, { title: `${data.settings[one.setting]}, seed ${one.seed}` }));
  one.rows.forEach((row, policy) => {
    const cell = make("td");
    if (row >= 0) {
      const value = shownValue(row);
      cell.textContent = (value === null ? "–" : typeof value === "number" ? Number(value.toPrecision(4)) : value) + MARKS[rank(row)];
      cell.className = CLASSES[rank(row)];
      cell.title = data.reasons[data.rows.reason[row]];
      cell.onclick = () => choose(one, policy);
      cell.classList.toggle("chosen", data.rows.job[row] === state.chosen);
    }
    cell.classList.toggle("at", one === state.one && policy === state.column);
    found.append(cell);
  });
  return found;
}
function move(lines, columns) {
  const at = Math.min(Math.max(state.shown.indexOf(state.one) + lines, 0), state.shown.length - 1);
  state.one = state.shown[at];
  state.column = Math.min(Math.max(state.column + columns, 0), data.policies.length - 1);
  const top = at * ROW;
  if (top < matrix.scrollTop) matrix.scrollTop = top;
  if (top + 2 * ROW > matrix.scrollTop + matrix.clientHeight - ROW) matrix.scrollTop = top + 3 * ROW - matrix.clientHeight;
  draw();
}
matrix.addEventListener("scroll", () => requestAnimationFrame(draw));
for (const id of ["find", "setting", "outcome", "measure"]) $(id).addEventListener("input", () => { matrix.scrollTop = 0; filter(); });

// ---- the chosen episode
function choose(one, policy) {
  const row = one.rows[policy];
  if (row < 0) return null;
  const rows = data.rows;
  Object.assign(state, { one, column: policy, chosen: rows.job[row] });
  draw();
  const list = make("dl");
  const say = (name, ...parts) => { const dd = make("dd"); dd.append(...parts); list.append(make("dt", name), dd); };
  say("policy", data.policies[policy]);
  say("scenario", `${one.key} (${data.settings[one.setting]}, seed ${one.seed})`);
  say("outcome", `${data.statuses[rows.status[row]]}${rows.success[row] ? ", success" : ""}: ${data.reasons[rows.reason[row]]}`);
  for (const [name, heading] of data.measures) {
    const value = rows.values[name][row];
    if (value !== null && value !== undefined && name !== "outcome") say(heading, String(value));
  }
  const files = [];
  if (rows.trace[row]) files.push(make("a", "episode", { href: `episodes/${rows.trace[row]}.npz` }), " ");
  if (rank(row) === 2) files.push(make("a", "traceback", { href: `failures/${rows.job[row]}.txt` }));
  if (files.length) say("files", ...files);
  say("again", make("code", `pushplan runs reproduce ${data.folder} --job ${rows.job[row].slice(0, 12)}`));
  $("chosen").replaceChildren(list);
  return showReplays(one, policy);
}

function chooseFirst() { // of the first scenario with a replay in the page the worst episode, as it ended
  for (const one of state.shown) {
    const worth = one.rows.map((row) => (row >= 0 && data.rows.replay[row] === 1 ? rank(row) : -1));
    const column = worth.indexOf(Math.max(...worth));
    if (worth[column] < 0) continue;
    choose(one, column).then(() => seek(player.end));
    return;
  }
}

// ---- keys
document.addEventListener("keydown", (event) => {
  const typing = event.target.matches("input[type=search], select, textarea");
  if (event.key === "Escape" && typing) event.target.blur();
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  const inMatrix = event.target === matrix;
  const keys = {
    "/": () => $("find").focus(), d: switchTheme, p: togglePlans, ",": () => stepBy(-1), ".": () => stepBy(1),
    " ": event.target.matches("button, a") ? null : togglePlay,
    ArrowUp: inMatrix && (() => move(-1, 0)), ArrowDown: inMatrix && (() => move(1, 0)),
    ArrowLeft: inMatrix && (() => move(0, -1)), ArrowRight: inMatrix && (() => move(0, 1)),
    PageUp: inMatrix && (() => move(-10, 0)), PageDown: inMatrix && (() => move(10, 0)),
    Enter: inMatrix && (() => state.shown.includes(state.one) && choose(state.one, state.column)),
  };
  if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
});
