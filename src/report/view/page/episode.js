// What the page carries: robots, meshes and episodes, and where everything is at a time.

function bytesOf(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes.buffer;
}

const floats = text => new Float32Array(bytesOf(text));

/** A robot: from joint positions to the matrices of its links. */
class Robot {
  constructor(raw) {
    this.name = raw.name;
    this.joints = raw.joints.map(joint => ({ ...joint, origin: matrixOf(joint.origin) }));
    this.parts = raw.parts.map(part => ({ ...part, pose: matrixOf(part.pose) }));
  }

  links(q) {
    const links = [new Float32Array(IDENTITY)];
    this.joints.forEach((joint, i) => {
      const link = product(links[joint.parent], joint.origin);
      moveAlongZ(link, q[i], joint.slides);
      links.push(link);
    });
    return links;
  }
}

/** An episode: a row of numbers a step (positions of the joints, then a pose of each object), and what happened when. */
class Episode {
  constructor(raw, number, robots) {
    Object.assign(this, raw);
    this.number = number;
    this.robot = robots[raw.robot];
    this.joints = this.robot.joints.length;
    this.width = this.joints + 7 * raw.objects.length;
    this.rows = floats(raw.rows);
    this.expected = raw.ghost && floats(raw.ghost.rows);
    this.end = raw.steps * data.period_s;
    this.charts = raw.charts.map(chart => {
      const all = floats(chart.values), length = raw.steps + 1;
      return { ...chart, values: chart.lines.map((_, i) => all.subarray(i * length, (i + 1) * length)) };
    });
  }

  /** The row at a time, between two steps in proportion; rows of before the start and after the end are the first and the last. */
  row(rows, time) {
    const step = clamp(time / data.period_s, 0, this.steps), first = Math.min(Math.floor(step), Math.max(this.steps - 1, 0));
    const share = step - first, a = first * this.width, b = Math.min(first + 1, this.steps) * this.width;
    const row = new Float32Array(this.width);
    for (let i = 0; i < this.width; i++) row[i] = rows[a + i] + (rows[b + i] - rows[a + i]) * share;
    for (let at = this.joints; at < this.width; at += 7) {
      // Signs of quaternions are continuous along an episode: the way between two is the short one.
      const length = Math.hypot(row[at + 3], row[at + 4], row[at + 5], row[at + 6]) || 1;
      for (let k = 3; k < 7; k++) row[at + k] /= length;
    }
    return row;
  }

  /** Matrices of links and objects at a time, recorded or, with `expected`, as the dynamics network saw it coming. */
  poses(time, expected = false) {
    const row = this.row(expected ? this.expected : this.rows, time);
    const objects = this.objects.map((_, i) => matrixOf(row, this.joints + 7 * i));
    return { links: this.robot.links(row), objects };
  }

  step(time) {
    return clamp(Math.round(time / data.period_s), 0, this.steps);
  }
}

const data = JSON.parse(document.getElementById("data").textContent);
const robots = data.robots.map(raw => new Robot(raw));
const episodes = data.episodes.map((raw, number) => new Episode(raw, number, robots));
