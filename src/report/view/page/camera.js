// An eye that goes around a point: by mouse, touch and pinch.

class Camera {
  constructor(surface, changed) {
    this.changed = changed;
    this.fingers = new Map();
    this.reset();
    surface.addEventListener("pointerdown", e => {
      surface.setPointerCapture(e.pointerId);
      this.fingers.set(e.pointerId, [e.clientX, e.clientY]);
    });
    surface.addEventListener("pointermove", e => this.fingers.has(e.pointerId) && this.drag(e, surface));
    for (const end of ["pointerup", "pointercancel"]) surface.addEventListener(end, e => this.fingers.delete(e.pointerId));
    surface.addEventListener("wheel", e => {
      e.preventDefault();
      this.nearer(Math.exp(-clamp(e.deltaY, -120, 120) * 0.0015));
    }, { passive: false });
    surface.addEventListener("contextmenu", e => e.preventDefault());
    surface.addEventListener("dblclick", () => this.reset());
  }

  reset() {
    const { eye_m, at_m } = data.look, back = minus(eye_m, at_m);
    this.at = [at_m[0], at_m[1], at_m[2] * 0.72];
    // A little farther than the pictures of hilt render, so that the table's near edge is seen too.
    this.distance = Math.hypot(...back);
    this.turn = Math.atan2(back[1], back[0]);
    this.rise = Math.asin(back[2] / this.distance);
    this.distance *= 1.12;
    this.changed();
  }

  drag(e, surface) {
    const before = this.fingers.get(e.pointerId), now = [e.clientX, e.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    if (this.fingers.size === 1) {
      if (e.shiftKey || e.buttons & 6) {
        this.move(dx, dy, surface.clientHeight);
      } else {
        this.turn -= dx * 0.006;
        this.rise = clamp(this.rise + dy * 0.006, 0.03, 1.55);
      }
    } else if (this.fingers.size === 2) {
      const [other] = [...this.fingers].filter(([id]) => id !== e.pointerId).map(([, place]) => place);
      const apart = place => Math.hypot(place[0] - other[0], place[1] - other[1]) || 1;
      this.nearer(apart(now) / apart(before));
      this.move(dx / 2, dy / 2, surface.clientHeight);
    }
    this.fingers.set(e.pointerId, now);
    this.changed();
  }

  nearer(times) {
    this.distance = clamp(this.distance / times, 0.15, 8);
    this.changed();
  }

  move(dx, dy, height) {
    const metres = this.distance * data.look.view_height / height, [s, c] = [Math.sin(this.turn), Math.cos(this.turn)];
    const up = [-c * Math.sin(this.rise), -s * Math.sin(this.rise), Math.cos(this.rise)];
    const right = [-s, c, 0];
    this.at = this.at.map((v, i) => clamp(v - right[i] * dx * metres + up[i] * dy * metres, -2, 2));
  }

  /** Eye and matrix for a picture of that many pixels; a narrow one shows the same width as one of 4:3. */
  of(width, height) {
    const flat = Math.cos(this.rise) * this.distance;
    const eye = [this.at[0] + flat * Math.cos(this.turn), this.at[1] + flat * Math.sin(this.turn), this.at[2] + Math.sin(this.rise) * this.distance];
    const zoom = 2 * Math.min(height, width / data.look.aspect) / (height * data.look.view_height);
    return { eye, camera: cameraOf(eye, this.at, zoom, width / height) };
  }
}
