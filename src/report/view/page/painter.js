// WebGL 2: closed meshes with light from above, soft shadows on the table, and things that can be seen through.

const SOLID_VERTEX = `#version 300 es
layout(location = 0) in vec3 at;
layout(location = 1) in vec3 normal;
uniform mat4 world, camera;
uniform float size;
out vec3 point, facing;
void main() {
  vec4 place = world * vec4(at * size, 1.0);
  point = place.xyz;
  facing = mat3(world) * normal;
  gl_Position = camera * place;
}`;
const SOLID_FRAGMENT = `#version 300 es
precision highp float;
in vec3 point, facing;
uniform vec3 color, light, eye;
uniform float alpha;
out vec4 seen;
void main() {
  vec3 n = normalize(facing);
  float bright = 0.56 + 0.10 * n.z + 0.42 * max(dot(n, light), 0.0);
  float shine = 0.10 * pow(max(dot(n, normalize(light + normalize(eye - point))), 0.0), 28.0);
  seen = vec4((color * bright + shine) * alpha, alpha);
}`;
// Flattens what stands on the table along the light; the picture is the table from above.
const FLAT_VERTEX = `#version 300 es
layout(location = 0) in vec3 at;
uniform mat4 world;
uniform float size;
uniform vec3 light;
uniform vec4 table;
void main() {
  vec3 place = (world * vec4(at * size, 1.0)).xyz;
  vec2 on = place.xy - light.xy * (place.z / light.z);
  gl_Position = vec4((on - table.xy) / table.zw * 2.0 - 1.0, 0.0, 1.0);
}`;
const FLAT_FRAGMENT = `#version 300 es
precision mediump float;
uniform float strength;
out vec4 seen;
void main() { seen = vec4(strength); }`;
const SCREEN_VERTEX = `#version 300 es
out vec2 place;
void main() {
  place = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
  gl_Position = vec4(place * 2.0 - 1.0, 0.0, 1.0);
}`;
const BLUR_FRAGMENT = `#version 300 es
precision mediump float;
in vec2 place;
uniform sampler2D mask;
uniform vec2 along;
out vec4 seen;
void main() {
  // Between two pixels the texture mixes them: five looks see nine.
  float sum = texture(mask, place).r * 0.227;
  sum += (texture(mask, place + along * 1.385).r + texture(mask, place - along * 1.385).r) * 0.316;
  sum += (texture(mask, place + along * 3.231).r + texture(mask, place - along * 3.231).r) * 0.0705;
  seen = vec4(sum);
}`;
const TABLE_VERTEX = `#version 300 es
uniform mat4 camera;
uniform vec4 table;
out vec2 place, at;
void main() {
  place = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  at = table.xy + table.zw * place;
  gl_Position = camera * vec4(at, 0.0, 1.0);
}`;
const TABLE_FRAGMENT = `#version 300 es
precision highp float;
in vec2 place, at;
uniform sampler2D mask;
uniform vec3 color;
uniform float line, shade;
out vec4 seen;
void main() {
  vec2 cells = at * 10.0, wide = fwidth(cells);
  vec2 near = smoothstep(wide * 1.3, wide * 0.3, abs(fract(cells - 0.5) - 0.5));
  float grid = max(near.x, near.y) * line;
  seen = vec4(color * (1.0 + grid) * (1.0 - shade * texture(mask, place).r), 1.0);
}`;

/** Pixels along an edge of the shadows' picture. */
const MASK = 160;

class Painter {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.gl = gl;
    this.solid = this.program(SOLID_VERTEX, SOLID_FRAGMENT);
    this.flat = this.program(FLAT_VERTEX, FLAT_FRAGMENT);
    this.blur = this.program(SCREEN_VERTEX, BLUR_FRAGMENT);
    this.top = this.program(TABLE_VERTEX, TABLE_FRAGMENT);
    this.masks = [];
    this.half = this.target();
    this.bare = gl.createVertexArray();
    this.light = unit(data.light);
    const [[x0, x1], [y0, y1]] = data.table_m;
    this.table = [x0, y0, x1 - x0, y1 - y0];
    this.meshes = data.meshes.map(mesh => this.upload(
      new Int16Array(bytesOf(mesh.at)), gl.SHORT, new Int8Array(bytesOf(mesh.normal)), gl.BYTE, new Uint16Array(bytesOf(mesh.index)), mesh.size));
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error("a shader cannot be built: " + gl.getProgramInfoLog(program));
    const at = {};
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(program, i);
      at[name] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  }

  target() {
    const gl = this.gl, texture = gl.createTexture(), frame = gl.createFramebuffer();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R8, MASK, MASK);
    for (const edge of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, edge, gl.CLAMP_TO_EDGE);
    for (const way of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, way, gl.LINEAR);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return { texture, frame };
  }

  /** Places (whole numbers are shares of `size`), normals and corners become a mesh. */
  upload(places, placeType, normals, normalType, index, size) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    [[places, placeType], [normals, normalType]].forEach(([values, type], slot) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(slot);
      gl.vertexAttribPointer(slot, 3, type, type !== gl.FLOAT, 0, 0);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return { array, count: index.length, size };
  }

  /** A tube along points, six numbers of triangles a piece: what is drawn of it can end at any point. */
  tube(points, radius) {
    const gl = this.gl, sides = 4, places = [], normals = [], index = [];
    points.forEach((point, i) => {
      const way = minus(points[Math.min(i + 1, points.length - 1)], points[Math.max(i - 1, 0)]);
      const along = Math.hypot(...way) > 1e-6 ? unit(way) : [0, 0, 1];
      const u = unit(cross(along, Math.abs(along[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), v = cross(along, u);
      for (let k = 0; k < sides; k++) {
        const turn = 2 * Math.PI * k / sides, c = Math.cos(turn), s = Math.sin(turn);
        const normal = [0, 1, 2].map(r => u[r] * c + v[r] * s);
        places.push(...[0, 1, 2].map(r => point[r] + normal[r] * radius));
        normals.push(...normal);
        if (i + 1 < points.length) {
          const a = i * sides + k, b = i * sides + (k + 1) % sides;
          index.push(a, b, b + sides, a, b + sides, a + sides);
        }
      }
    });
    const mesh = this.upload(new Float32Array(places), gl.FLOAT, new Float32Array(normals), gl.FLOAT, new Uint32Array(index), 1);
    return { ...mesh, wide: true, piece: 6 * sides };
  }

  use({ program, at }, uniforms) {
    this.gl.useProgram(program);
    for (const [name, value] of Object.entries(uniforms)) this.gl[["uniform1f", "", "uniform2fv", "uniform3fv", "uniform4fv"][value.length ?? 0]](at[name], value);
    this.at = at;
  }

  /** One thing, with the program in use. */
  draw({ mesh, matrix, color, from = 0, to = mesh.count }, alpha = 1) {
    const gl = this.gl, bytes = mesh.wide ? 4 : 2;
    gl.uniformMatrix4fv(this.at.world, false, matrix);
    gl.uniform1f(this.at.size, mesh.size);
    if (this.at.color) gl.uniform3fv(this.at.color, color);
    if (this.at.alpha) gl.uniform1f(this.at.alpha, alpha);
    gl.bindVertexArray(mesh.array);
    gl.drawElements(gl.TRIANGLES, to - from, mesh.wide ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT, from * bytes);
  }

  /** How dark the table of scene number `n` is where things stand between it and the light; of all scenes before the first is drawn. */
  shadows(n, { solids, glass }) {
    const gl = this.gl, mask = this.masks[n] ??= this.target(), other = this.half;
    const casters = [[solids, 1], ...glass.filter(group => group.casts).map(group => [group.things, group.alpha])];
    gl.viewport(0, 0, MASK, MASK);
    // What faces away from the light flattens to a back and casts the same shadow as the rest.
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, mask.frame);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    this.use(this.flat, { light: this.light, table: this.table });
    for (const [things, strength] of casters) {
      gl.uniform1f(this.at.strength, strength);
      things.forEach(thing => this.draw(thing));
    }
    gl.bindVertexArray(this.bare);
    for (const [from, to, along] of [[mask, other, [1 / MASK, 0]], [other, mask, [0, 1 / MASK]]]) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, to.frame);
      gl.bindTexture(gl.TEXTURE_2D, from.texture);
      this.use(this.blur, { along });
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.enable(gl.DEPTH_TEST);
  }

  /** Everything in one colour. */
  wipe(color) {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, null);
    this.gl.clearColor(...color, 1);
    this.gl.clear(this.gl.COLOR_BUFFER_BIT);
  }

  /**
   * Scene number `n` into a part of the canvas (x, y from below, width, height in pixels), which is wiped. `solids` are drawn whole, `glass` is a list of
   * groups of things to be seen through with their opacity.
   */
  scene(n, [x, y, width, height], { eye, camera }, look, { solids, glass, lines }) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.masks[n].texture);
    gl.viewport(x, y, width, height);
    gl.scissor(x, y, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.clearColor(...look.back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const common = { light: this.light, eye };
    this.use(this.solid, common);
    gl.uniformMatrix4fv(this.at.camera, false, camera);
    solids.forEach(thing => this.draw(thing));
    this.draw({ mesh: this.meshes[data.table_mesh], matrix: IDENTITY, color: scaled(look.table, 0.9) });
    this.use(this.top, { table: this.table, color: look.table, line: look.line, shade: look.shade });
    gl.uniformMatrix4fv(this.at.camera, false, camera);
    gl.bindVertexArray(this.bare);
    gl.disable(gl.CULL_FACE);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.enable(gl.CULL_FACE);
    this.use(this.solid, common);
    gl.uniformMatrix4fv(this.at.camera, false, camera);
    gl.enable(gl.BLEND);
    lines.forEach(({ alpha, ...thing }) => this.draw(thing, alpha));
    // Behind what it coincides with.
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 4);
    for (const { things, alpha } of glass) {
      // First the depth of all of them, then the colour of what is nearest: nothing of their inside shows.
      gl.colorMask(false, false, false, false);
      things.forEach(thing => this.draw(thing));
      gl.colorMask(true, true, true, true);
      gl.depthFunc(gl.LEQUAL);
      things.forEach(thing => this.draw(thing, alpha));
      gl.depthFunc(gl.LESS);
    }
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
  }
}
