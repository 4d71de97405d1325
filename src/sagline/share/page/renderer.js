/* Solids and lines in perspective, by WebGL 2: nothing but what a cable robot needs. */
"use strict";

const renderer = (() => {
  const SOLID = [`#version 300 es
    in vec3 place; in vec3 normal; uniform mat4 view; uniform mat4 model; out vec3 facing;
    void main() { facing = mat3(model) * normal; gl_Position = view * (model * vec4(place, 1.0)); }`, `#version 300 es
    precision highp float; in vec3 facing; uniform vec4 color; uniform float flatness; out vec4 shown;
    void main() {
      vec3 n = normalize(facing);
      float light = 0.62 + 0.22 * n.z + 0.24 * max(dot(n, normalize(vec3(0.5, -0.8, 0.35))), 0.0);
      shown = vec4(color.rgb * mix(light, 1.0, flatness), 1.0) * color.a;
    }`];
  // a segment is a rectangle as wide on the screen as it should be, half its width longer at either end
  const LINE = [`#version 300 es
    in vec2 corner; in vec3 from; in vec3 to; in vec4 tint; in float width;
    uniform mat4 view; uniform vec2 size; out vec4 color; out float across; out float half_width;
    void main() {
      vec4 a = view * vec4(from, 1.0), b = view * vec4(to, 1.0);
      const float near = 1e-4;
      if (a.w < near && b.w < near) { gl_Position = vec4(0.0, 0.0, 2.0, 1.0); return; }
      if (a.w < near) a = mix(a, b, (near - a.w) / (b.w - a.w));
      if (b.w < near) b = mix(b, a, (near - b.w) / (a.w - b.w));
      vec2 pa = a.xy / a.w * size, pb = b.xy / b.w * size;
      vec2 along = length(pb - pa) > 1e-6 ? normalize(pb - pa) : vec2(1.0, 0.0);
      half_width = 0.5 * width;
      float wide = half_width + 0.75; // room to fade in
      vec4 end = corner.x < 0.5 ? a : b;
      vec2 shift = along * (corner.x - 0.5) * width + vec2(-along.y, along.x) * corner.y * wide;
      across = corner.y * wide;
      color = tint;
      gl_Position = vec4(end.xy + shift / size * end.w, end.zw);
    }`, `#version 300 es
    precision highp float; in vec4 color; in float across; in float half_width; out vec4 shown;
    void main() {
      float cover = clamp(half_width + 0.5 - abs(across), 0.0, 1.0);
      if (cover < 0.02) discard;
      shown = vec4(color.rgb, 1.0) * color.a * cover;
    }`];
  const STRIDE = 11; // numbers of a segment: two ends, color and opacity, width

  function program(gl, [vertex, fragment]) {
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const at = (name) => gl.getUniformLocation(made, name);
    return { made, at, attribute: (name) => gl.getAttribLocation(made, name) };
  }

  function pointed(gl, place, size, stride, offset, divisor) {
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * stride, 4 * offset);
    gl.vertexAttribDivisor(place, divisor);
  }

  /** Normals of triangles, one for each corner. */
  function normals(corners) {
    const found = new Float32Array(corners.length);
    for (let k = 0; k < corners.length; k += 9) {
      const [ax, ay, az, bx, by, bz] = [3, 4, 5, 6, 7, 8].map((j) => corners[k + j] - corners[k + (j % 3)]);
      const normal = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], length = Math.hypot(...normal) || 1;
      for (let j = 0; j < 9; j++) found[k + j] = normal[j % 3] / length;
    }
    return found;
  }

  /** A picture on a canvas; null where the browser has no WebGL 2. */
  function on(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) return null;
    const solid = program(gl, SOLID), line = program(gl, LINE);
    const strips = gl.createVertexArray(), corners = gl.createBuffer(), instances = gl.createBuffer();
    gl.bindVertexArray(strips);
    gl.bindBuffer(gl.ARRAY_BUFFER, corners);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([0, -1, 1, -1, 0, 1, 1, 1]), gl.STATIC_DRAW);
    pointed(gl, line.attribute("corner"), 2, 2, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, instances);
    for (const [name, size, offset] of [["from", 3, 0], ["to", 3, 3], ["tint", 4, 6], ["width", 1, 10]])
      pointed(gl, line.attribute(name), size, STRIDE, offset, 1);

    function mesh(triangles) {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      for (const [name, values] of [["place", new Float32Array(triangles)], ["normal", normals(triangles)]]) {
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
        gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
        pointed(gl, solid.attribute(name), 3, 3, 0, 0);
      }
      return { array, count: triangles.length / 3 };
    }

    function begin(view) {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      for (const { made, at } of [solid, line]) {
        gl.useProgram(made);
        gl.uniformMatrix4fv(at("view"), false, view);
      }
      gl.uniform2f(line.at("size"), canvas.width / 2, canvas.height / 2);
    }

    /** A mesh somewhere; flat without light and without hiding what is behind, as a shadow is. */
    function draw({ array, count }, model, color, flat = false) {
      gl.useProgram(solid.made);
      gl.uniformMatrix4fv(solid.at("model"), false, model);
      gl.uniform4fv(solid.at("color"), color);
      gl.uniform1f(solid.at("flatness"), flat ? 1 : 0);
      gl.depthMask(!flat);
      gl.bindVertexArray(array);
      gl.drawArrays(gl.TRIANGLES, 0, count);
      gl.depthMask(true);
    }

    /** Segments, one after the other in an array of numbers; faint ones hide nothing. */
    function segments(numbers, faint = false) {
      gl.useProgram(line.made);
      gl.bindVertexArray(strips);
      gl.bindBuffer(gl.ARRAY_BUFFER, instances);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.DYNAMIC_DRAW);
      gl.depthMask(!faint);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, numbers.length / STRIDE);
      gl.depthMask(true);
    }

    return { begin, draw, mesh, segments };
  }

  return { on };
})();
