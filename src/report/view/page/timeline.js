// The time: a lane for each episode that is shown, with its phases, contacts, milestones and end, and a cursor to drag.

const PHASES = { approach: "#7aa7e8", close: "#f2b84b", carry: "#58b98a", open: "#e58a6d", retreat: "#b39ddb" };
const TOUCH = { fingers: "#f08c2e", objects: "#3d86f0", bad: "#e04848" };
/** Heights \[CSS pixels\]. */
const LANE = { names: 15, phase: 12, touch: 4, gap: 6, axis: 17 };

/** A canvas with as many pixels as the screen; returns what draws on it, in CSS pixels. */
function sheet(canvas, height) {
  const density = Math.min(devicePixelRatio || 1, 3), width = canvas.clientWidth;
  canvas.width = Math.round(width * density);
  canvas.height = Math.round(height * density);
  canvas.style.height = height + "px";
  const pen = canvas.getContext("2d");
  pen.scale(density, density);
  pen.font = "11px system-ui, sans-serif";
  return { pen, width, height };
}

const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Round distances between ticks, so that about `count` fit into `span`. */
function ticks(span, count) {
  const raw = span / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw || 1));
  return power * ([1, 2, 5, 10].find(m => m * power >= raw) ?? 10);
}

class Timeline {
  constructor(box, canvas, hint, seek) {
    Object.assign(this, { box, canvas, hint });
    const timeAt = e => {
      const at = canvas.getBoundingClientRect();
      return clamp((e.clientX - at.left - 6) / Math.max(at.width - 12, 1), 0, 1) * this.duration;
    };
    box.addEventListener("pointerdown", e => {
      box.setPointerCapture(e.pointerId);
      this.held = true;
      seek(timeAt(e));
    });
    box.addEventListener("pointermove", e => {
      if (this.held) seek(timeAt(e));
      this.tell(timeAt(e), e.clientX - box.getBoundingClientRect().left, e.clientY - canvas.getBoundingClientRect().top);
    });
    for (const end of ["pointerup", "pointercancel"]) box.addEventListener(end, () => { this.held = false; });
    box.addEventListener("pointerleave", () => { hint.hidden = true; });
  }

  /** What happens under the pointer, in words. */
  tell(time, x, y) {
    const lane = this.lanes?.find(lane => y >= lane.top && y < lane.bottom);
    const words = lane ? happening(lane.episode, lane.episode.step(time)).map(what => what.name) : [];
    this.hint.hidden = false;
    this.hint.textContent = [time.toFixed(2) + " s", ...words].join(" \u00b7 ");
    const half = this.hint.offsetWidth / 2;
    this.hint.style.left = clamp(x, half, Math.max(this.box.clientWidth - half, half)) + "px";
  }

  draw(state) {
    this.duration = state.duration;
    const shown = state.shown.map(n => episodes[n]), chosen = episodes[state.selected];
    const high = episode => LANE.phase + LANE.touch * (episode === chosen ? Math.max(episode.touches.length, 1) : 1) + LANE.gap;
    const { pen, width, height } = sheet(this.canvas, LANE.names + LANE.axis + shown.reduce((sum, episode) => sum + high(episode), 0));
    const x = time => 6 + time / (state.duration || 1) * (width - 12);
    this.lanes = [];
    let top = LANE.names;
    for (const episode of shown) {
      this.lane(pen, episode, top, x, episode === chosen, shown.length > 1);
      this.lanes.push({ episode, top: episode === chosen ? top - LANE.names : top, bottom: top + high(episode) });
      top += high(episode);
    }
    this.axis(pen, state.duration, top, x, width);
    const at = x(state.time);
    pen.fillStyle = css("--cursor");
    pen.fillRect(at - 0.75, 4, 1.5, height - LANE.axis - 4);
    pen.beginPath();
    pen.arc(at, 5, 4.5, 0, 7);
    pen.fill();
  }

  lane(pen, episode, top, x, chosen, several) {
    const t = step => x(step * data.period_s), bar = (from, to, y, high, color) => {
      pen.fillStyle = color;
      pen.fillRect(t(from), y, Math.max(t(to) - t(from), 1), high);
    };
    bar(0, episode.steps, top, LANE.phase, css("--tint"));
    for (const [from, to, name] of episode.phases) {
      bar(from, to, top, LANE.phase, PHASES[name]);
      if (chosen && t(to) - t(from) > pen.measureText(name).width + 10) {
        pen.fillStyle = "#10151c";
        pen.fillText(name, t(from) + 5, top + LANE.phase - 2.5);
      }
    }
    episode.touches.forEach(({ kind, spans }, i) => {
      if (chosen || kind === "fingers") spans.forEach(([from, to]) => bar(from, to, top + LANE.phase + 1 + (chosen ? LANE.touch * i : 0), LANE.touch - 1, TOUCH[kind]));
    });
    let free = 0;
    for (const [step, name] of episode.milestones) {
      pen.fillStyle = css("--ink");
      pen.fillRect(t(step) - 0.5, top - (chosen ? 4 : 0), 1, LANE.phase + (chosen ? 4 : 0));
      const wide = pen.measureText(name).width, left = Math.min(t(step) + 3, x(this.duration) - wide);
      if (chosen && left > free) {
        pen.fillStyle = css("--soft");
        pen.fillText(name, left, top - 4);
        free = left + wide + 4;
      }
    }
    if (several) bar(0, episode.steps, top - 1.5, 1.5, own(episode));
    pen.fillStyle = css(episode.success ? "--good" : "--bad");
    pen.beginPath();
    pen.arc(t(episode.steps), top + LANE.phase / 2, 4.5, 0, 7);
    pen.fill();
  }

  axis(pen, duration, top, x, width) {
    const step = ticks(duration, width / 70);
    pen.fillStyle = css("--soft");
    pen.strokeStyle = css("--rule");
    for (let time = 0; time <= duration + 1e-6; time += step) {
      pen.fillRect(x(time), top - 3, 0.6, 4);
      const words = +time.toFixed(3) + " s";
      pen.fillText(words, clamp(x(time) - pen.measureText(words).width / 2, 0, width - pen.measureText(words).width), top + 12);
    }
  }
}

/** What holds in a step: the phase, and who touches whom. */
function happening(episode, step) {
  const within = ([from, to]) => step >= from && step < Math.max(to, from + 1);
  const phase = episode.phases.filter(within).map(([, , name]) => ({ name, color: PHASES[name] }));
  return [...phase, ...episode.touches.filter(({ spans }) => spans.some(within)).map(({ name, kind }) => ({ name, color: TOUCH[kind] }))];
}
