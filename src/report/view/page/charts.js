// Charts of the selected episode that follow the cursor; the same lines of the others are there, faintly, where they can be compared.

/** Room for the numbers at the left \[CSS pixels\]. */
const LABELS = 32;

class Charts {
  constructor(box, seek) {
    Object.assign(this, { box, seek, key: "" });
  }

  /** New elements when another episode is selected. */
  prepare(episode) {
    const key = episode.charts.map(chart => chart.title + chart.lines).join();
    if (key === this.key) return;
    this.key = key;
    this.box.replaceChildren();
    this.charts = episode.charts.map(({ title, unit, lines }, i) => {
      const chart = make("div", { className: "chart" }), canvas = make("canvas"), values = make("div", { className: "lines" });
      chart.append(make("h2", {}, title, make("span", {}, unit)), canvas, values);
      const numbers = lines.map((name, k) => {
        const number = make("b");
        values.append(make("span", {}, make("i", { style: "background:" + OWN[k % OWN.length] }), name + " ", number));
        return number;
      });
      const go = e => {
        const at = canvas.getBoundingClientRect();
        this.seek(clamp((e.clientX - at.left - LABELS) / (at.width - LABELS), 0, 1) * this.duration);
      };
      canvas.addEventListener("pointerdown", go);
      canvas.addEventListener("pointermove", e => e.buttons & 1 && go(e));
      this.box.append(chart);
      return { canvas, numbers, i };
    });
  }

  draw(state) {
    const chosen = episodes[state.selected], others = state.shown.filter(n => n !== state.selected).map(n => episodes[n]);
    this.duration = state.duration;
    this.prepare(chosen);
    for (const { canvas, numbers, i } of this.charts) {
      const chart = chosen.charts[i];
      const faint = chart.compare ? others.flatMap(other => other.charts.filter(theirs => theirs.title === chart.title)) : [];
      this.one(canvas, chart, faint, state);
      const step = chosen.step(state.time);
      numbers.forEach((number, k) => { number.textContent = (+chart.values[k][step].toFixed(chart.digits) || 0).toFixed(chart.digits); });
    }
  }

  one(canvas, chart, faint, state) {
    const { pen, width, height } = sheet(canvas, 104);
    let [low, high] = [0, 0];
    for (const line of [chart, ...faint].flatMap(some => some.values)) for (const v of line) [low, high] = [Math.min(low, v), Math.max(high, v)];
    const room = (high - low || 1) * 0.06;
    const y = v => 4 + (high + room - v) / (high - low + 2 * room) * (height - 8), x = time => LABELS + time / (state.duration || 1) * (width - LABELS);
    const step = ticks(high - low || 1, 3);
    pen.fillStyle = css("--faint");
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9; v += step) {
      pen.globalAlpha = Math.abs(v) < 1e-9 ? 0.7 : 0.28;
      pen.fillRect(LABELS, y(v), width - LABELS, 1);
      pen.globalAlpha = 1;
      const words = String(+v.toFixed(6));
      pen.fillText(words, LABELS - 6 - pen.measureText(words).width, y(v) + 4);
    }
    const line = (values, color, alpha) => {
      pen.globalAlpha = alpha;
      pen.strokeStyle = color;
      pen.lineWidth = 1.5;
      pen.lineJoin = "round";
      pen.beginPath();
      values.forEach((v, t) => pen.lineTo(x(t * data.period_s), y(v)));
      pen.stroke();
    };
    faint.forEach(other => other.values.forEach((values, k) => line(values, OWN[k % OWN.length], 0.25)));
    chart.values.forEach((values, k) => line(values, OWN[k % OWN.length], 1));
    pen.globalAlpha = 1;
    pen.fillStyle = css("--cursor");
    pen.fillRect(clamp(x(state.time), LABELS, width - 1.5) - 0.5, 0, 1.5, height);
  }
}
