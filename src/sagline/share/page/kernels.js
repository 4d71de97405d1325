/* The compiled kernels: a WebAssembly module and its calls, as `sagline.share.packing` describes them. */
"use strict";

const kernels = (() => {
  const KINDS = { float64: Float64Array, int64: BigInt64Array, int8: Int8Array, bool: Uint8Array };
  const PAGE = 65536; // bytes

  const bytesOf = (text) => Uint8Array.from(atob(text), (each) => each.charCodeAt(0));

  async function inflated(text) {
    const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  /** Arrays and functions by their names; text: the module, deflated, in base64. */
  async function made(text, { size, filled, arrays, calls }) {
    const { instance: { exports } } = await WebAssembly.instantiate(await inflated(text), {});
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

  return { inflated, made };
})();
