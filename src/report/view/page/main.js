// The page: what is shown, the time, and the ways to change both.

const by = id => document.getElementById(id);

/** An element with properties and children. */
function make(name, properties = {}, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

/** As many are shown at first; more can be added by hand. */
const AT_FIRST = 4;
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
/** How long the end is shown before it begins again \[s\]. */
const REST_S = 1.2;
const ICONS = { play: "M7 4v16l13-8z", pause: "M6 4h4v16H6zM14 4h4v16h-4z" };

const state = {
  time: 0, duration: 0, playing: false, speed: 1, rest: 0, selected: 0, overlay: false, paths: true, ghost: true,
  shown: episodes.slice(0, AT_FIRST).map(episode => episode.number),
};
let stage = null, dirty = true, changedCells = true;
const touch = () => { dirty = true; };
const camera = new Camera(by("view"), touch);
const timeline = new Timeline(by("slider"), by("timeline"), by("hint"), seek);
const charts = new Charts(by("charts"), seek);
const atlas = data.atlas && new Atlas(by("atlas"), data.atlas, n => { only(n); seek(0); play(true); scrollTo({ top: 0, behavior: "smooth" }); });

function seek(time) {
  state.time = clamp(time, 0, state.duration);
  state.rest = 0;
  touch();
}

function play(on) {
  if (on && state.time >= state.duration) state.time = 0;
  state.playing = on;
  by("play-icon").setAttribute("d", on ? ICONS.pause : ICONS.play);
  by("play").setAttribute("aria-label", on ? "Pause" : "Play");
  touch();
}

function byStep(steps) {
  play(false);
  seek(Math.round(state.time / data.period_s + steps) * data.period_s);
}

function show(shown, selected) {
  state.shown = shown;
  state.selected = selected;
  state.duration = Math.max(...shown.map(n => episodes[n].end));
  state.time = Math.min(state.time, state.duration);
  changedCells = true;
  touch();
}

const only = n => show([n], n);
/** Takes an episode into the picture, or out of it. */
function toggle(n) {
  if (!state.shown.includes(n)) return show([...state.shown, n], n);
  const left = state.shown.filter(other => other !== n);
  if (left.length) show(left, left.includes(state.selected) ? state.selected : left[0]);
}
const select = n => state.shown.includes(n) ? show(state.shown, n) : only(n);

function toggleKey(key) {
  state[key] = !state[key];
  by(key).setAttribute("aria-pressed", String(state[key]));
  changedCells = true;
  touch();
}

// --- what stands around the scene ---

function dotOf(episode) {
  return make("i", { className: "dot " + (episode.success ? "good" : "bad") });
}

function chips() {
  const several = state.shown.length > 1;
  by("chips").replaceChildren(...episodes.map(episode => {
    const shown = state.shown.includes(episode.number);
    const chip = make("span", { className: "chip" + (shown ? " shown" : "") + (episode.number === state.selected ? " selected" : "") });
    if (several && shown) chip.style.setProperty("--of", own(episode));
    const name = make("button", { className: "name", title: `${episode.name}: ${episode.ending}` }, dotOf(episode), episode.name);
    name.addEventListener("click", () => select(episode.number));
    const more = make("button", { className: "more", title: shown ? "Take out" : "Put beside" }, shown ? "\u2212" : "+");
    more.setAttribute("aria-label", `${more.title}: ${episode.name}`);
    more.addEventListener("click", () => toggle(episode.number));
    chip.append(name, ...(shown && !several ? [] : [more]));
    return chip;
  }));
  by("chips").hidden = episodes.length === 1;
}

function cells() {
  const shown = state.overlay ? [state.selected] : state.shown, several = state.shown.length > 1;
  const box = by("stage").getBoundingClientRect(), columns = bestColumns(shown.length, box.width / Math.max(box.height, 1));
  by("cells").style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
  by("cells").style.gridTemplateRows = `repeat(${Math.ceil(shown.length / columns)}, minmax(0, 1fr))`;
  by("cells").replaceChildren(...shown.map(n => {
    const cell = make("div", { className: "cell" + (n === state.selected && several ? " selected" : "") });
    const listed = state.overlay ? state.shown : [n];
    for (const k of listed) {
      const swatch = several ? make("i", { className: "dot good", style: "background:" + own(episodes[k]) }) : "";
      cell.append(make("b", {}, swatch, make("span", {}, episodes[k].name)), make("small", {}, make("span", {}, episodes[k].about + " "), make("span", { className: "end" })), make("br"));
    }
    if (several) cell.style.setProperty("--of", own(episodes[n]));
    return cell;
  }));
}

/** So many side by side that the pictures, each of 4:3, are largest. */
function bestColumns(count, aspect) {
  const sizes = Array.from({ length: count }, (_, i) => Math.min(aspect / (i + 1) / data.look.aspect, 1 / Math.ceil(count / (i + 1))));
  return sizes.indexOf(Math.max(...sizes)) + 1;
}

function legend() {
  const episode = episodes[state.selected], now = happening(episode, episode.step(state.time)).map(what => what.name);
  const all = [...new Set(episode.phases.map(([, , name]) => name))].map(name => ({ name, color: PHASES[name] }));
  all.push(...episode.touches.map(({ name, kind }) => ({ name, color: TOUCH[kind] })));
  by("legend").replaceChildren(...all.map(({ name, color }) => make("span", { className: now.includes(name) ? "on" : "" }, make("i", { style: "background:" + color }), name)));
  by("now").textContent = [...now, ...(state.time >= episode.end ? [episode.ending] : [])].join(" \u00b7 ");
}

function endings() {
  const listed = state.shown;
  document.querySelectorAll("#cells .end").forEach((end, i) => {
    const episode = episodes[listed[i]], over = state.time >= episode.end;
    end.textContent = over ? episode.ending : "";
    end.className = "end" + (over ? " over" : "") + (over && episode.success ? " good" : "");
  });
}

// --- drawing ---

function frame() {
  if (changedCells) {
    cells();
    chips();
    stage?.fit();
    changedCells = false;
  }
  stage?.draw(state, camera);
  endings();
  legend();
  timeline.draw(state);
  charts.draw(state);
  atlas?.draw(state);
  by("clock").textContent = `${state.time.toFixed(2)} / ${state.duration.toFixed(2)} s`;
  by("slider").setAttribute("aria-valuemax", state.duration.toFixed(2));
  by("slider").setAttribute("aria-valuenow", state.time.toFixed(2));
  dirty = false;
}

let before = 0;
function loop(now) {
  const passed = Math.min((now - before) / 1000, 0.1);
  before = now;
  if (state.playing) {
    if (state.time < state.duration) state.time = Math.min(state.time + passed * state.speed, state.duration);
    else if ((state.rest += passed) > REST_S) [state.time, state.rest] = [0, 0];
    dirty = true;
  }
  if (dirty) frame();
  requestAnimationFrame(loop);
}

// --- hands on ---

by("play").addEventListener("click", () => play(!state.playing));
by("back").addEventListener("click", () => byStep(-1));
by("on").addEventListener("click", () => byStep(1));
by("reset").addEventListener("click", () => camera.reset());
by("ask").addEventListener("click", () => by("help").showModal());
by("speed").addEventListener("change", e => { state.speed = +e.target.value; });
for (const key of ["overlay", "paths", "ghost"]) by(key).addEventListener("click", () => toggleKey(key));

function faster(steps) {
  state.speed = SPEEDS[clamp(SPEEDS.indexOf(state.speed) + steps, 0, SPEEDS.length - 1)];
  by("speed").value = String(state.speed);
}

function neighbour(way) {
  only((state.selected + way + episodes.length) % episodes.length);
}

const KEYS = {
  " ": () => play(!state.playing), ArrowLeft: e => byStep(e.shiftKey ? -10 : -1), ArrowRight: e => byStep(e.shiftKey ? 10 : 1),
  Home: () => seek(0), End: () => seek(state.duration), "-": () => faster(-1), "+": () => faster(1), "=": () => faster(1),
  n: () => neighbour(1), b: () => neighbour(-1), o: () => toggleKey("overlay"), p: () => toggleKey("paths"), g: () => toggleKey("ghost"),
  r: () => camera.reset(), "?": () => by("help").showModal(),
};

addEventListener("keydown", e => {
  if (e.ctrlKey || e.metaKey || e.altKey || by("help").open || e.target.tagName === "SELECT") return;
  if (e.key === " " && e.target.tagName === "BUTTON") return;
  const digit = /^Digit([1-9])$/.exec(e.code), number = digit && +digit[1] - 1;
  const act = digit ? number < episodes.length && (() => (e.shiftKey ? toggle(number) : only(number))) : KEYS[e.key];
  if (!act) return;
  e.preventDefault();
  act(e);
});
for (const what of [dark, matchMedia("(resolution: 1dppx)")]) what.addEventListener("change", () => { changedCells = true; touch(); });
new ResizeObserver(() => { changedCells = true; touch(); }).observe(by("stage"));

// --- the beginning ---

by("title").textContent = data.title;
by("atlas").hidden = !atlas;
document.body.classList.toggle("atlas", Boolean(atlas));
by("ghost").hidden = !episodes.some(episode => episode.expected);
by("overlay").hidden = episodes.length === 1;
try {
  stage = new Stage(by("view"), by("cells"));
} catch (why) {
  by("trouble").textContent = `No picture: ${why.message}. Times and charts are there.`;
  by("trouble").hidden = false;
}
show(state.shown, 0);
frame();
play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
requestAnimationFrame(now => {
  before = now;
  loop(now);
});

/** For tests and the curious: what the page shows. Poses are those of the last picture: of links and objects, 16 numbers each, column by column. */
window.hilt = {
  state, play, seek, show, frame, camera,
  firstFrame_ms: performance.now(),
  poses: n => stage && { links: stage.drawn.get(n).links.map(m => [...m]), objects: stage.drawn.get(n).objects.map(m => [...m]) },
  /** Mean time of a picture of the scene alone, waited for \[ms\]. */
  pictureTime_ms(count) {
    const { gl } = stage.painter, pixel = new Uint8Array(4), start = performance.now();
    for (let i = 0; i < count; i++) {
      state.time = state.duration * i / count;
      stage.draw(state, camera);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    }
    return (performance.now() - start) / count;
  },
};
