// The scene: which episodes are seen where, and what is drawn of each.

const LOOKS = {
  light: { back: [246, 247, 249], table: [226, 221, 212], line: -0.07, shade: 0.34, lift: 1 },
  dark: { back: [14, 17, 22], table: [62, 66, 74], line: 0.20, shade: 0.50, lift: 1.18 },
};
/** Colours by which episodes in one picture are told apart. */
const OWN = ["#4c8dff", "#ff8c42", "#2fb67c", "#c77dff", "#e5b93c", "#ff5d73", "#38c6d9", "#9aa4b2", "#b08968"];
const GHOST = [0.86, 0.30, 0.86];
const OUTCOME = { good: [0.16, 0.66, 0.36], bad: [0.88, 0.27, 0.27] };

const own = episode => OWN[episode.number % OWN.length];
const rgbOf = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16) / 255);
const mixed = (a, b, share) => a.map((v, i) => v + (b[i] - v) * share);
const dark = matchMedia("(prefers-color-scheme: dark)");

class Stage {
  constructor(canvas, cells) {
    this.canvas = canvas;
    this.cells = cells;
    this.painter = new Painter(canvas);
    this.tubes = new Map();
  }

  /** Colours of this scheme, 0 to 1. */
  look() {
    const look = LOOKS[dark.matches ? "dark" : "light"];
    const shares = rgb => rgb.map(v => v / 255);
    return { ...look, back: shares(look.back), table: shares(look.table) };
  }

  /** The canvas has as many pixels as the screen, up to twice as many as CSS has. */
  fit() {
    const density = Math.min(devicePixelRatio || 1, 2), box = this.canvas.getBoundingClientRect();
    this.density = density;
    const [width, height] = [Math.max(1, Math.round(box.width * density)), Math.max(1, Math.round(box.height * density))];
    if (this.canvas.width !== width || this.canvas.height !== height) [this.canvas.width, this.canvas.height] = [width, height];
    this.places = [...this.cells.children].map(cell => {
      const at = cell.getBoundingClientRect();
      const x = Math.round((at.left - box.left) * density), y = Math.round((box.bottom - at.bottom) * density);
      return [x, y, Math.max(1, Math.round(at.width * density)), Math.max(1, Math.round(at.height * density))];
    });
  }

  draw(state, camera) {
    const look = this.look();
    this.drawn = new Map();
    if (state.overlay) {
      const chosen = episodes[state.selected], others = state.shown.filter(n => n !== state.selected).map(n => episodes[n]);
      const scene = this.of(chosen, state, look, true);
      for (const other of others) {
        const { solids, lines } = this.of(other, state, look, true, 0.7);
        scene.glass.push({ things: solids, alpha: 0.42, casts: true });
        scene.lines.push(...lines);
      }
      this.paint([scene], look, camera);
    } else {
      this.paint(state.shown.map(n => this.of(episodes[n], state, look, false)), look, camera);
    }
  }

  /** First all shadows: to go back and forth between pictures costs more than to draw them. */
  paint(scenes, look, camera) {
    scenes.forEach((scene, i) => this.painter.shadows(i, scene));
    this.painter.wipe(look.back);
    scenes.forEach((scene, i) => {
      const place = this.places[i];
      this.painter.scene(i, place, camera.of(place[2], place[3]), look, scene);
    });
  }

  /** Everything that is seen of one episode; with `tinted` in its own colour. */
  of(episode, state, look, tinted, tinting = 0.4) {
    const { meshes } = this.painter, poses = episode.poses(state.time), tint = rgbOf(own(episode));
    this.drawn.set(episode.number, poses);
    const color = (rgb, share) => mixed(rgb.map(v => Math.min(v / 255 * look.lift, 1)), tint, tinted ? share : 0);
    const robot = links => episode.robot.parts.map(part => (
      { mesh: meshes[part.mesh], matrix: product(links[part.link], part.pose), color: color(part.rgb, tinting) }));
    const solids = robot(poses.links);
    episode.objects.forEach((object, i) => solids.push({ mesh: meshes[object.mesh], matrix: poses.objects[i], color: color(object.rgb, object.moved ? 0.25 : 0) }));
    const glass = [], lines = [];
    for (const { mesh, rgb, alpha, casts } of episode.fixed) {
      const thing = { mesh: meshes[mesh], matrix: IDENTITY, color: rgb.map(v => v / 255) };
      if (alpha < 1) glass.push({ things: [thing], alpha });
      else if (casts) solids.push(thing);
      else lines.push({ ...thing, alpha });
    }
    if (state.ghost && episode.expected) {
      const expected = episode.poses(state.time, true), things = robot(expected.links);
      episode.objects.forEach((object, i) => object.moved && things.push({ mesh: meshes[object.mesh], matrix: expected.objects[i] }));
      glass.push({ things: things.map(thing => ({ ...thing, color: GHOST })), alpha: 0.4 });
    }
    if (state.paths) lines.push(...this.path(episode, state.time, tinted ? tint : OUTCOME[episode.success ? "good" : "bad"]));
    return { solids, glass, lines };
  }

  /** Where the moved objects were, and faintly where they will be. */
  path(episode, time, color) {
    if (!this.tubes.has(episode.number)) {
      const of = i => Array.from({ length: episode.steps + 1 }, (_, t) => {
        const at = t * episode.width + episode.joints + 7 * i;
        return [...episode.rows.subarray(at, at + 3)];
      });
      const moved = episode.objects.map((object, i) => object.moved && episode.steps > 0 ? [this.painter.tube(of(i), 0.0018)] : []);
      this.tubes.set(episode.number, moved.flat());
    }
    return this.tubes.get(episode.number).flatMap(mesh => {
      const to = mesh.piece * Math.floor(clamp(time / data.period_s, 0, episode.steps)), thing = { mesh, matrix: IDENTITY, color };
      return [{ ...thing, to, alpha: 1 }, { ...thing, from: to, alpha: 0.28 }].filter(part => (part.to ?? mesh.count) > (part.from ?? 0));
    });
  }
}
