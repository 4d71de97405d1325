/* Kinematics of a cable robot with sagging cables, by the kernels of sagline in kernels.wasm. SI units.
   The interface, see docs/howto/javascript.md:

   import { load } from "sagline";
   const sagline = await load();             // reads kernels.wasm
   const robot = await sagline.robot(json);  // json: written by `sagline convert ROBOT --kind javascript`
   robot.inverse({ position, quaternion });  // { feasible, status, reason, tension, length, short, blocking }
   robot.forward(length, pose);              // { solved, status, reason, position, quaternion, tension }
   robot.courses(pose, tension);             // points of each cable

   A pose has the position of the platform frame's origin [m] and the unit quaternion x, y, z, w. */
"use strict";

const sagline = (() => {
  const KINDS = { float64: Float64Array, int64: BigInt64Array, int8: Int8Array, bool: Uint8Array };
  const PAGE = 65536; // bytes
  const SHORTEST = 1e-9; // m, of a chord
  const UNIT = 1e-6; // largest difference of the length of a quaternion from 1
  const FARTHEST = 1e6; // m

  const bytesOf = (text) => Uint8Array.from(atob(text), (each) => each.charCodeAt(0));

  /** Bytes of a deflated text in base64. */
  async function inflated(text) {
    const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  /** Checksum as that of zlib. */
  function crc32(bytes) {
    let rest = -1;
    for (const byte of bytes) {
      rest ^= byte;
      for (let k = 0; k < 8; k++) rest = (rest >>> 1) ^ (rest & 1 ? 0xedb88320 : 0);
    }
    return ~rest >>> 0;
  }

  /** Arrays and functions by their names, in an instance with its own memory; described by `sagline.share.packing`. */
  async function instance(module, { size, filled, arrays, calls }) {
    const { exports } = await WebAssembly.instantiate(module, {});
    exports._initialize();
    const { memory } = exports, first = PAGE * memory.grow(Math.ceil(size / PAGE)), found = {};
    for (const [place, data] of filled) new Uint8Array(memory.buffer).set(bytesOf(data), first + place);
    for (const [name, [kind, place, count]] of Object.entries(arrays)) found[name] = new KINDS[kind](memory.buffer, first + place, count);
    const number = (each) => (each.endsWith("n") ? BigInt(each.slice(0, -1)) : Number(each));
    for (const [name, [entry, given]] of Object.entries(calls)) {
      const list = given.map((each) => (Array.isArray(each) ? first + each[0] : typeof each === "string" ? number(each) : each));
      found[name] = () => {
        if (exports[`sagline_${entry}`](...list)) throw new Error(`${entry}: too little memory`);
      };
    }
    return found;
  }

  /** Numbers of an argument; RangeError if they are too few, too many or not as `allowed`. */
  function numbers(given, item, count, allowed, good) {
    const list = Array.from(given ?? []);
    if (list.length === count && list.every((each) => typeof each === "number" && good(each))) return list;
    throw new RangeError(`${item} is ${list.length ? list.join(", ") : given}; allowed: ${count} numbers, ${allowed}.`);
  }

  /** Functions of a robot; machine: its data from `sagline.share.machine`, of: its kernels. */
  function robotOf(machine, of) {
    const each = (array) => Array.from(array), where = (flags) => flags.flatMap((flag, i) => (flag ? [i] : []));
    const cables = machine.anchors.length;

    function place({ position, quaternion }) {
      const at = numbers(position, "position", 3, `up to ${FARTHEST} m`, (one) => Math.abs(one) <= FARTHEST);
      const turn = numbers(quaternion, "quaternion", 4, "-1 to 1", (one) => Math.abs(one) <= 1 + UNIT);
      const size = Math.hypot(...turn);
      if (!(Math.abs(size - 1) <= UNIT)) throw new RangeError(`the length of the quaternion is ${size}; allowed: 1 to ${UNIT}.`);
      of.pose.set([...at, ...turn]);
    }

    /** A platform at rest: tensions of least norm within their limits [N] and lengths [m], or why there are none. */
    function inverse(pose) {
      place(pose);
      of.inverse();
      if (machine.undecided.includes(of.status[0])) of.decide();
      const status = of.status[0], found = { feasible: status === 0, status, reason: machine.statuses[status], short: 0, blocking: [] };
      if (status === 0) return { ...found, tension: each(of.tension), length: each(of.length) };
      const none = { ...found, tension: null, length: null, short: NaN };
      if (status === machine.chordless) {
        return { ...none, blocking: where(each(of.span).map((span, i) => !(Math.hypot(span, of.rise[i]) >= SHORTEST))) };
      }
      if (status !== machine.infeasible) return none;
      const [proved, enough] = of.bracket, short = enough === Infinity && Number.isFinite(proved) ? NaN : enough;
      return { ...none, short, blocking: where(each(of.blocking)) };
    }

    /** The equilibrium of a platform on cables of given lengths [m], from a pose close by; chord tensions [N]. Null if none is found. */
    function forward(length, pose) {
      const given = numbers(length, "length", cables, "> 0 m", (one) => one > 0 && one <= FARTHEST);
      place(pose);
      of.given.set(given);
      of.forward();
      const [x, y, z, ...quaternion] = of.rest, status = of.restStatus[0];
      const found = { solved: status === 0, status, reason: machine.rests[status] };
      if (machine.lost.includes(status)) return { ...found, position: null, quaternion: null, tension: null };
      return { ...found, position: [x, y, z], quaternion, tension: each(of.restTension) };
    }

    /** Points of each cable [m] at chord tensions [N], from frame anchor over pulley to platform end; straight where NaN. */
    function courses(pose, tension) {
      const drawn = numbers(tension, "tension", cables, ">= 0 N or NaN", (one) => (one >= 0 && one < Infinity) || Number.isNaN(one));
      place(pose);
      of.drawn.set(drawn);
      of.draw();
      const { points } = of, count = points.length / (3 * cables);
      return Array.from({ length: cables }, (_, i) => Array.from({ length: count }, (_, k) => {
        const first = 3 * (i * count + k);
        return [points[first], points[first + 1], points[first + 2]];
      }));
    }

    return { name: machine.name, cables, inverse, forward, courses };
  }

  /** The compiled module; bytes: those of kernels.wasm. */
  async function load(bytes) {
    const module = await WebAssembly.compile(bytes);

    async function robot(given) {
      const machine = typeof given === "string" ? JSON.parse(given) : given;
      if (!machine?.kernels) throw new TypeError("not a robot of sagline; write it by: sagline convert ROBOT --kind javascript");
      if (machine.module !== undefined && machine.module !== crc32(bytes)) {
        throw new TypeError(`the robot is for another kernels.wasm; write it again by version ${machine.version} of this package, or of sagline`);
      }
      return robotOf(machine, await instance(module, machine.kernels));
    }

    return { robot, calls: (described) => instance(module, described) };
  }

  return { inflated, load };
})();

/* Exports: a page contains only the lines above. */

/** Compile the kernels. source: the bytes of kernels.wasm, or its URL; the file beside this one if left out. */
export async function load(source = new URL("kernels.wasm", import.meta.url)) {
  return sagline.load(source instanceof URL ? await read(source) : new Uint8Array(source));
}

async function read(url) {
  if (url.protocol === "file:" && globalThis.process?.versions?.node) return (await import("node:fs/promises")).readFile(url);
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url}: ${answer.status} ${answer.statusText}`);
  return new Uint8Array(await answer.arrayBuffer());
}
