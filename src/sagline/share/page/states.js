/* What a page carries of a run: columns of whole numbers, as differences, deflated; `sagline.share.packing` wrote them. */
"use strict";

const states = (() => {
  /** Whole numbers from the planes of their bytes, lowest first; the sign is the lowest bit. */
  function numbers(bytes, first, planes, count) {
    return Array.from({ length: count }, (_, k) => {
      let code = 0;
      for (let plane = planes - 1; plane >= 0; plane--) code = code * 256 + bytes[first + plane * count + k];
      return code % 2 ? -(code + 1) / 2 : code / 2;
    });
  }

  /** From differences of an order back to what they are of. */
  function summed(values, order) {
    for (let pass = 0; pass < order; pass++)
      for (let k = 1; k < values.length; k++) values[k] += values[k - 1];
    return values;
  }

  const value = {
    linear: (step) => (code) => code * step,
    relative: (step) => (code) => Math.exp(code * step),
  };

  /** Columns by their names: arrays of Float64Array; a code that stands for nothing becomes NaN. */
  async function unpacked(header, text) {
    const bytes = await sagline.inflated(text), found = {};
    let place = 0;
    for (const { name, scale, step, nothing, columns } of header.channels) {
      const number = value[scale](step);
      found[name] = columns.map(([order, planes]) => {
        const codes = summed(numbers(bytes, place, planes, header.count), order);
        place += planes * header.count;
        return Float64Array.from(codes, (code) => (code === nothing ? NaN : number(code)));
      });
    }
    return found;
  }

  return { unpacked };
})();
