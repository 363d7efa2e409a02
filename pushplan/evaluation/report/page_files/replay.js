// Recorded episodes, drawn: scrubbed, played, two of a scenario side by side in step.
const replays = new Map(); // job -> what page.py packed
for (const one of document.querySelectorAll("script.replay")) {
  const found = JSON.parse(one.textContent);
  replays.set(found.job, found);
}
window.pushplanReplay = (found) => replays.set(found.job, found); // called by the files beside the page

const player = { views: [], time: 0, end: 0, playing: false, last: 0, one: null };

async function unpacked(replay) {
  if (replay.poses) return replay;
  const bytes = Uint8Array.from(atob(replay.packed), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const view = new DataView(await new Response(stream).arrayBuffer());
  const { bodies, frames, scales } = replay;
  const poses = new Float64Array(bodies * 3 * frames);
  const firsts = bodies * 3;
  for (let line = 0; line < firsts; line++) { // first values, then differences from frame to frame
    let value = view.getInt32(4 * line, true);
    poses[line * frames] = value * scales[line % 3];
    for (let k = 1; k < frames; k++) {
      value += view.getInt16(4 * firsts + 2 * (line * (frames - 1) + k - 1), true);
      poses[line * frames + k] = value * scales[line % 3];
    }
  }
  return Object.assign(replay, { poses });
}
function loaded(job, where) {
  if (replays.has(job)) return Promise.resolve(replays.get(job));
  if (where !== 2) return Promise.resolve(null);
  return new Promise((done) => {
    const script = make("script", "", { src: `replays/${job}.js` });
    script.onload = () => done(replays.get(job) || null);
    script.onerror = () => done(null);
    document.body.append(script);
  });
}
async function showReplays(one, policy) {
  player.one = one;
  const has = (p) => one.rows[p] >= 0 && data.rows.replay[one.rows[p]] > 0;
  $("player").hidden = !has(policy);
  if (!has(policy)) {
    $("chosen").append(make("p", `No replay of this episode is in the page: pushplan report ${data.folder} --replays beside`, { className: "note" }));
    return;
  }
  const others = data.policies.map((_, p) => p).filter((p) => p !== policy && has(p));
  const beside = $("beside");
  const wanted = beside.value;
  beside.replaceChildren(make("option", "nobody", { value: "" }), ...others.map((p) => make("option", data.policies[p], { value: p })));
  beside.value = others.map(String).includes(wanted) ? wanted : others.length ? String(others[0]) : "";
  beside.onchange = () => setViews(policy);
  await setViews(policy);
}
async function setViews(policy) {
  const shown = [policy, ...($("beside").value === "" ? [] : [Number($("beside").value)])];
  const { chosen } = state;
  const jobs = shown.map((p) => player.one.rows[p]);
  const found = await Promise.all(jobs.map((row) => loaded(data.rows.job[row], data.rows.replay[row])));
  const views = [];
  for (const [i, replay] of found.entries()) {
    if (!replay) continue;
    const box = make("figure");
    const canvas = make("canvas");
    const caption = make("figcaption", data.policies[shown[i]], { className: "policy" });
    caption.style.setProperty("--policy", colourOf(shown[i]));
    box.append(caption, canvas);
    views.push({ canvas, box, replay: await unpacked(replay), policy: shown[i] });
  }
  if (chosen !== state.chosen) return; // another one was chosen meanwhile
  player.views = views;
  player.end = Math.max(...views.map((view) => view.replay.times.at(-1)));
  $("views").replaceChildren(...views.map((view) => view.box));
  seek(0);
}
const frameAt = (times, time) => {
  let [low, high] = [0, times.length - 1];
  while (low < high) { const middle = (low + high + 1) >> 1; if (times[middle] <= time) low = middle; else high = middle - 1; }
  return low;
};
function seek(time) {
  player.time = Math.min(Math.max(time, 0), player.end);
  $("time").value = player.end > 0 ? Math.round(1000 * player.time / player.end) : 0;
  $("clock").textContent = `${player.time.toFixed(1)} s`;
  for (const view of player.views) drawView(view);
}
function togglePlay() {
  if (!player.views.length) return;
  player.playing = !player.playing;
  $("play").textContent = player.playing ? "❚❚" : "▶";
  if (!player.playing) return;
  if (player.time >= player.end) player.time = 0;
  player.last = performance.now();
  requestAnimationFrame(tick);
}
function tick(now) {
  if (!player.playing) return;
  seek(player.time + (now - player.last) / 1000 * Number($("speed").value));
  player.last = now;
  if (player.time >= player.end) togglePlay(); else requestAnimationFrame(tick);
}
function stepBy(frames) {
  if (!player.views.length) return;
  const { times } = player.views[0].replay;
  seek(times[Math.min(Math.max(frameAt(times, player.time) + frames, 0), times.length - 1)]);
}
const togglePlans = () => { $("plans").checked = !$("plans").checked; seek(player.time); };
$("plans").onchange = () => seek(player.time);
$("play").onclick = togglePlay;
$("time").oninput = () => seek(Number($("time").value) / 1000 * player.end);
addEventListener("resize", () => seek(player.time));

const COLOURS = data.colours;
function drawView({ canvas, box, replay }) {
  const [x0, y0, x1, y1] = replay.bounds;
  const width = box.clientWidth || 400;
  const scale = Math.min(width / (x1 - x0), 460 / (y1 - y0));
  const ratio = window.devicePixelRatio || 1;
  const [w, h] = [(x1 - x0) * scale, (y1 - y0) * scale];
  canvas.width = w * ratio; canvas.height = h * ratio; canvas.style.width = `${w}px`; canvas.style.height = `${h}px`;
  const pen = canvas.getContext("2d");
  pen.setTransform(scale * ratio, 0, 0, -scale * ratio, -x0 * scale * ratio, y1 * scale * ratio);
  pen.lineWidth = 1.2 / scale;
  const outline = (points) => {
    pen.beginPath();
    for (let i = 0; i < points.length; i += 2) pen.lineTo(points[i], points[i + 1]);
    pen.closePath();
  };
  const filled = (points, fill, stroke) => {
    outline(points);
    if (fill) { pen.fillStyle = fill; pen.fill(); }
    if (stroke) { pen.strokeStyle = stroke; pen.stroke(); }
  };
  const { goal, frames, poses } = replay;
  if (goal.kind === "disc") { pen.beginPath(); pen.arc(...goal.center, goal.radius, 0, 2 * Math.PI); pen.fillStyle = "#009e7333"; pen.fill(); }
  if (goal.heading !== undefined) {
    const [[x, y], size] = [goal.center, Math.max(goal.radius, 14 / scale)];
    const [dx, dy] = [size * Math.cos(goal.heading), size * Math.sin(goal.heading)];
    filled([x - 0.35 * dy, y + 0.35 * dx, x + 0.35 * dy, y - 0.35 * dx, x + dx, y + dy], COLOURS.goal);
  }
  for (const points of goal.parts ?? []) filled(points, "#009e7322", COLOURS.goal);
  if (goal.kind === "line") {
    const [[px, py], [nx, ny]] = [goal.point, goal.normal];
    const far = x1 - x0 + y1 - y0;
    pen.beginPath(); pen.moveTo(px - ny * far, py + nx * far); pen.lineTo(px + ny * far, py - nx * far);
    pen.strokeStyle = COLOURS.goal; pen.stroke();
  }
  for (const points of replay.walls) filled(points, COLOURS.wall);
  for (const [ax, ay, bx, by, radius] of replay.segments) {
    pen.beginPath(); pen.moveTo(ax, ay); pen.lineTo(bx, by);
    pen.lineWidth = Math.max(2 * radius, 1.2 / scale); pen.lineCap = "round"; pen.strokeStyle = COLOURS.wall; pen.stroke();
  }
  pen.lineWidth = 1.2 / scale;
  const k = frameAt(replay.times, player.time);
  const pose = (body, frame) => [0, 1, 2].map((axis) => poses[(3 * body + axis) * frames + frame]);
  const placed = (parts, [x, y, angle], fill, stroke) => {
    pen.save(); pen.translate(x, y); pen.rotate(angle);
    for (const points of parts) filled(points, fill, stroke);
    pen.restore();
  };
  replay.objects.forEach(({ rings }, i) => placed(rings, pose(i + 1, 0), null, COLOURS.ghost));
  replay.objects.forEach(({ parts, rings }, i) => {
    placed(parts, pose(i + 1, k), `${COLOURS.object}cc`, null);
    placed(rings, pose(i + 1, k), null, COLOURS.edge);
  });
  pen.beginPath();
  for (let frame = 0; frame <= k; frame++) pen.lineTo(...pose(0, frame).slice(0, 2));
  pen.strokeStyle = COLOURS.trail; pen.stroke();
  const plan = $("plans").checked && replay.plans.findLast((one) => one.time <= player.time);
  if (plan) {
    pen.setLineDash([5 / scale, 4 / scale]);
    pen.beginPath();
    for (let i = 0; i < plan.path.length; i += 2) pen.lineTo(plan.path[i], plan.path[i + 1]);
    pen.strokeStyle = COLOURS.plan; pen.stroke();
    plan.moved.forEach((body, i) => placed(replay.objects[body].rings, plan.ends.slice(3 * i, 3 * i + 3), null, COLOURS.prediction));
    pen.setLineDash([]);
  }
  const [x, y, angle] = pose(0, k);
  placed(replay.robot, [x, y, angle], `${COLOURS.robot}cc`, COLOURS.robot_edge);
  const size = Math.max(...replay.robot.flat().map(Math.abs));
  pen.beginPath(); pen.moveTo(x, y); pen.lineTo(x + size * Math.cos(angle), y + size * Math.sin(angle));
  pen.strokeStyle = "#fff"; pen.stroke();
  const metre = 10 ** Math.floor(Math.log10((x1 - x0) / 3));
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.fillStyle = "#ffffffcc"; pen.fillRect(4, h - 28, metre * scale + 30, 24);
  pen.fillStyle = "#000"; pen.fillRect(8, h - 12, metre * scale, 3);
  pen.font = "11px system-ui, sans-serif"; pen.fillText(`${metre} m`, 8, h - 16);
}
