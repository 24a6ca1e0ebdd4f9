// How the episodes of an evaluation end, by class: where they start on the table, and pictures to play them from.

const CLASSES = ["#f0603c", "#b04fd8", "#e0a100", "#2f7fe8", "#d6336c", "#7a8594", "#8a5a2b", "#111111"];

class Atlas {
  constructor(box, atlas, open) {
    Object.assign(this, { box, atlas, open, off: new Set(), starts: [], pictures: new Map() });
    const failed = atlas.outcomes.filter(n => n > 0).length, all = atlas.outcomes.length;
    box.append(make("h2", {}, "How it ends"), make("p", {}, `${all - failed} of ${all} episodes solved, ${failed} failed. Each mark is where an episode starts; those with a dark edge are on this page: click one, or a picture, to play it.`));
    box.append(this.keys(), make("div", { className: "maps" }, ...atlas.maps.map(map => this.map(map))));
    // Failures first: they are what one comes for.
    const order = [...atlas.classes.keys()].slice(1).concat(0);
    order.forEach(n => this.section(n, atlas.classes[n]));
  }

  color(n) {
    return n === 0 ? css("--good") : CLASSES[(n - 1) % CLASSES.length];
  }

  /** A button for each outcome, which hides and shows its marks. */
  keys() {
    return make("div", { className: "keys" }, ...this.atlas.classes.map(({ name, count }, n) => {
      const key = make("button", {}, make("i", { className: "dot" + (n ? " bad" : " good"), style: "background:" + this.color(n) }), `${name} ${count}`);
      key.setAttribute("aria-pressed", "true");
      key.addEventListener("click", () => {
        const on = this.off.has(n);
        this.off[on ? "delete" : "add"](n);
        key.setAttribute("aria-pressed", String(on));
        this.starts.forEach(start => start.of === n && start.mark.classList.toggle("off", !on));
      });
      return key;
    }));
  }

  /** The part of the table where something starts, from above: x up and y to the left, as one sees it who stands behind the robot. */
  map({ name, at }) {
    const [[x0, x1], [y0, y1]] = [0, 1].map(axis => around(at.map(place => place[axis]))), size = 500 / (y1 - y0);
    const left = y => (y1 - y) * size, top = x => (x1 - x) * size;
    const svg = draw("svg", { viewBox: `-2 -2 504 ${(x1 - x0) * size + 4}`, role: "img", "aria-label": `Where ${name} starts` });
    svg.append(draw("rect", { class: "edge", x: 0, y: 0, width: 500, height: (x1 - x0) * size, rx: 6 }));
    const word = (text, x, y) => svg.append(Object.assign(draw("text", { x, y }), { textContent: text }));
    for (let v = Math.ceil(y0 * 10) / 10; v <= y1; v += 0.1) {
      svg.append(draw("line", { class: "grid", x1: left(v), x2: left(v), y1: 0, y2: top(x0) }));
      word("y " + v.toFixed(1), left(v) + 3, top(x0) - 5);
    }
    for (let v = Math.ceil(x0 * 10) / 10; v <= x1; v += 0.1) {
      svg.append(draw("line", { class: "grid", x1: 0, x2: 500, y1: top(v), y2: top(v) }));
      word("x " + v.toFixed(1), 4, top(v) - 3);
    }
    // Failures on top of successes, those to be played on top of all.
    const order = at.map((_, i) => i).sort((a, b) => this.weight(a) - this.weight(b));
    for (const i of order) svg.append(this.mark(i, left(at[i][1]), top(at[i][0])));
    return make("figure", { className: "map" }, make("figcaption", {}, name), svg, make("div", { className: "robot" }, "\u2193 robot"));
  }

  /** The mark of one episode: a circle for a success, a diamond for a failure. */
  mark(i, x, y) {
    const of = this.atlas.outcomes[i], here = this.atlas.shown[i], r = here === null ? 5.5 : 8, wide = r * 1.25;
    const mark = of === 0
      ? draw("circle", { cx: x, cy: y, r })
      : draw("path", { d: `M${x} ${y - wide}l${wide} ${wide}l${-wide} ${wide}l${-wide} ${-wide}z` });
    mark.setAttribute("class", "start" + (here === null ? "" : " here"));
    mark.setAttribute("fill", this.color(of));
    mark.append(Object.assign(draw("title", {}), { textContent: `episode ${this.atlas.numbers[i]}: ${this.atlas.classes[of].name}` }));
    if (here !== null) mark.addEventListener("click", () => this.open(here));
    this.starts.push({ mark, of });
    return mark;
  }

  weight(i) {
    return (this.atlas.outcomes[i] > 0) + 2 * (this.atlas.shown[i] !== null);
  }

  section(n, { name, words, count }) {
    const of = episodes.filter(episode => this.atlas.outcomes[this.atlas.shown.indexOf(episode.number)] === n);
    const dot = make("i", { className: "dot" + (n ? " bad" : " good"), style: "background:" + this.color(n) });
    const less = of.length < count ? `${count}, the first ${of.length} shown` : count;
    this.box.append(make("h3", {}, dot, name, make("span", { className: "count" }, String(less))), make("p", {}, words));
    this.box.append(make("div", { className: "pictures" }, ...of.map(episode => {
      const picture = make("button", {}, make("img", { src: episode.picture, alt: `The end of ${episode.name}` }));
      picture.append(make("span", {}, episode.name + " ", make("small", {}, `${episode.end.toFixed(1)} s`)));
      picture.addEventListener("click", () => this.open(episode.number));
      this.pictures.set(episode.number, picture);
      return picture;
    })));
  }

  draw(state) {
    this.pictures.forEach((picture, n) => picture.classList.toggle("selected", state.shown.includes(n)));
  }
}

/** The span of some numbers with room at its ends, half a metre at least \[m\]. */
function around(values) {
  const low = Math.min(...values), high = Math.max(...values), more = Math.max(0.06, (0.5 - (high - low)) / 2);
  return [low - more, high + more];
}

function draw(name, attributes) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
  return element;
}
