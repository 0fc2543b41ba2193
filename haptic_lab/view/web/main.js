// Time goes on, or back; what was recorded at that time is shown. Nothing is drawn that has not changed.

const element = (id) => document.getElementById(id);
const recorded = new Recorded();
const SLOW = 40, REST = 400, TELLING = 80; // ms, from one picture to the next, of rest, from one number to the next
const COARSEST = 0.4; // share of the pixels along an edge
const now = {
  at: 0, follows: true, plays: false, since: 0, changed: true, lost: false, shown: null, told: 0, drawn: 0, busy: false, mean: 0,
};
const changed = () => { now.changed = true; };
const panel = new Panel(recorded, seek);
let drawing = null, camera = null;

function seek(time) {
  const {states} = recorded;
  let at = states.findIndex((each) => each.time >= time);
  if (at < 0) at = states.length - 1;
  go(at);
}

/** Shows the state of some index, and stays there. */
function go(at) {
  now.at = Math.min(Math.max(at, 0), recorded.states.length - 1);
  now.follows = now.plays = false;
  changed();
}

function play() {
  const last = recorded.states.length - 1, runs = now.follows && !recorded.end && !now.lost;
  if (runs) now.follows = false;
  else if (now.plays) now.plays = false;
  else {
    if (now.at >= last) now.at = 0;
    Object.assign(now, {plays: true, follows: false, since: performance.now() - 1000 * (recorded.states[now.at]?.time ?? 0)});
  }
  changed();
}

function follow() { Object.assign(now, {follows: true, plays: false}); changed(); }

/** Moves on while it plays, at the pace at which it happened. */
function advance(clock) {
  const {states} = recorded, last = states.length - 1;
  if (now.follows && now.at !== last) { now.at = Math.max(last, 0); changed(); }
  if (!now.plays) return;
  const before = now.at;
  while (now.at < last && states[now.at + 1].time <= (clock - now.since) / 1000) now.at++;
  if (now.at !== before) changed();
  if (now.at >= last) { now.plays = false; now.follows = true; changed(); }
}

function render() {
  const {states, scene, end} = recorded;
  const state = scene && states.length ? states[Math.min(now.at, states.length - 1)] : null;
  const ticked = (id) => element(id).checked && !element(id).disabled;
  const threshold = Number(element("threshold").value), live = !end && !now.lost && scene;
  element("threshold-told").textContent = threshold.toFixed(2);
  const truth = ticked("show-truth") ? recorded.truth : null;
  const ready = state && recorded.at(states, state.step);
  if (drawing) drawing.draw(scene, {
    state: ready, truth, threshold, hand: ticked("show-hand"), ghosts: ticked("show-ghosts"),
    map: ready && ticked("show-map") ? recorded.at(recorded.maps, state.step) : null,
    surface: ready && ticked("show-surface") ? recorded.at(recorded.surfaces, state.step) : null,
  }, camera);
  now.shown = {ready, truth, live};
}

/** What is told in words and numbers, less often than pictures are drawn: nobody reads as fast. */
function tell() {
  const {ready, truth, live} = now.shown, {states, scene, end} = recorded;
  element("play").textContent = now.plays || (live && now.follows) ? "❚❚" : "▶";
  element("play").setAttribute("aria-label", now.plays || (live && now.follows) ? "pause" : "play");
  element("live").textContent = live ? "live" : "end";
  element("live").classList.toggle("on", now.follows);
  element("truth-label").hidden = !recorded.truth;
  element("status").textContent = told(live, end);
  if (!ready) return;
  element("time").max = states.length - 1;
  element("time").value = Math.min(now.at, states.length - 1);
  element("clock").textContent = `${ready.time.toFixed(2)} s` + (scene.seconds ? ` of ${Number(scene.seconds.toFixed(1))} s` : "");
  panel.show(ready, truth);
}

function told(live, end) {
  if (live) return now.follows ? "as it happens" : "paused; it goes on meanwhile";
  if (end) return end.told;
  return now.lost ? "no longer connected; this is what came until then" : "";
}

function take(line) {
  try {
    const kind = recorded.take(line);
    if (kind === "scene") {
      Object.assign(now, {at: 0, follows: true, plays: false, lost: false});
      if (camera) camera.begin(recorded.scene);
      panel.begin();
      if (drawing) notice("");
    }
  } catch (error) { notice(`what came cannot be read: ${error.message}`); }
  changed();
}

function notice(text) { element("notice").textContent = text; }

/** Lines as they come; once the sender is gone, those of the next one. */
async function listen() {
  for (;;) {
    try {
      const answer = await fetch("stream" + location.search);
      if (!answer.ok) { notice(await answer.text()); return; }
      const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
      for (let rest = "";;) {
        const {done, value} = await reader.read();
        if (done) break;
        const lines = (rest + value).split("\n");
        rest = lines.pop();
        lines.filter(Boolean).forEach(take); // empty ones tell that the sender is there
      }
    } catch { /* it is gone */ }
    if (recorded.scene && !recorded.end && !now.lost) { now.lost = true; changed(); }
    await new Promise((done) => setTimeout(done, 2000));
  }
}

/** Lines that are in this file. */
async function unpack(text) {
  const bytes = Uint8Array.from(atob(text.trim()), (each) => each.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  (await new Response(stream).text()).split("\n").filter(Boolean).forEach(take);
}

/** Where a machine cannot draw as fast as things move, they are drawn coarser until they rest. */
function pace(clock) {
  if (!drawing) return;
  const taken = clock - now.drawn;
  if (now.changed) {
    if (now.busy) now.mean += 0.3 * (Math.min(taken, 400) - now.mean);
    if (now.mean > SLOW && !drawing.few) {
      if (drawing.share > COARSEST) drawing.share *= 0.8;
      else drawing.few = true;
      now.mean = 0.8 * SLOW;
    }
    now.drawn = clock;
    now.busy = true;
  } else if (taken > REST) {
    now.busy = false;
    now.mean = 0;
    if (drawing.share < 1 && !drawing.sharp) { drawing.sharp = true; now.changed = true; return; }
  }
  drawing.sharp = drawing.sharp && !now.changed;
}

function frame(clock) {
  advance(clock);
  pace(clock);
  if (now.changed) { now.changed = false; render(); }
  if (now.shown && clock - now.told > TELLING) { tell(); now.shown = null; now.told = clock; }
  requestAnimationFrame(frame);
}

try {
  drawing = new Drawing(element("scene"));
  camera = new Camera(element("scene"), changed);
} catch (error) {
  drawing = null;
  notice(`nothing can be drawn: ${error.message}`);
}
for (const id of ["hand", "ghosts", "map", "surface", "truth"]) element(`show-${id}`).addEventListener("change", changed);
element("threshold").addEventListener("input", changed);
element("time").addEventListener("input", (event) => go(Number(event.target.value)));
element("play").addEventListener("click", play);
element("live").addEventListener("click", follow);
window.addEventListener("resize", changed);
window.addEventListener("keydown", (event) => {
  const ways = {
    " ": play, ArrowLeft: () => go(now.at - 1), ArrowRight: () => go(now.at + 1), Home: () => go(0), End: follow,
  };
  if (event.target.tagName === "INPUT" || event.target.tagName === "BUTTON" || !ways[event.key]) return;
  event.preventDefault();
  ways[event.key]();
});
requestAnimationFrame(frame);
const kept = element("recorded");
if (kept) unpack(kept.textContent).catch((error) => notice(`this file is damaged: ${error.message}`));
else listen();
