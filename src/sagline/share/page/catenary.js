/* The exact elastic cable: docs/model.md, section 2, P1 and P3; the tests compare it with the library's. SI units. */
"use strict";

const catenary = (() => {
  const STEPS = 80, SMALL = 1e-4; // of an argument whose function is left to two terms of its series

  const sinhc = (h) => (Math.abs(h) < SMALL ? 1 + (h * h) / 6 : Math.sinh(h) / h);
  const atanhc = (u) => (Math.abs(u) < SMALL ? 1 + (u * u) / 3 : Math.atanh(u) / u);

  /** L/D of the exact cable, from X = wD/(2 tau), the chord's angle and e = tau/EA: P3, Newton kept inside a bracket. */
  function lengthRatio(halfWeight, sine, cosine, strain) {
    let low = 0, high = Math.min(Math.hypot(sinhc(halfWeight) * cosine, sine), 1 / strain);
    let ratio = high / (1 + strain * high);
    for (let i = 0; i < STEPS; i++) {
      const taut = 1 - strain * ratio, h = halfWeight * taut;
      const s = taut * sinhc(h), c = strain * Math.cosh(h), inverse = 1 / (s + ratio * c);
      const pull = (sine * inverse) ** 2, root = Math.sqrt(cosine * cosine + pull);
      const excess = ratio - s * root;
      const slope = 1 + c * root - (pull * inverse * (s * s * (strain * halfWeight) ** 2 * ratio)) / root;
      if (excess > 0) high = ratio;
      else low = ratio;
      let next = ratio - excess / slope;
      if (!(low <= next && next <= high)) next = (low + high) / 2;
      const change = Math.abs(next - ratio);
      ratio = next;
      if (change <= 1e-15 * ratio) break;
    }
    return ratio;
  }

  /** Where the end of a cable of this length is, by the force on it: P1. */
  function endOf({ horizontal, vertical, length, weight, stiffness }) {
    const frame = Math.hypot(horizontal, vertical - weight * length);
    const total = frame + Math.hypot(horizontal, vertical);
    return {
      x: horizontal * length * (1 / stiffness + (2 / total) * atanhc((weight * length) / total)),
      z: (vertical - (weight * length) / 2) * length * (1 / stiffness + 2 / total),
    };
  }

  /** What models answer in, and what follows from it. */
  function state(given, length, vertical) {
    const chord = Math.hypot(given.span, given.rise), weight = given.density * given.gravity;
    const horizontal = (given.tension * given.span) / chord;
    return {
      ...given, chord, weight, length, horizontal, vertical,
      frameEnd: Math.hypot(horizontal, vertical - weight * length),
      platformEnd: Math.hypot(horizontal, vertical),
    };
  }

  /** The exact cable at a chord tension; given: span, rise, density, stiffness, tension, gravity. */
  function exact(given) {
    const { span, rise, tension, stiffness } = given;
    const chord = Math.hypot(span, rise), sine = rise / chord, strain = tension / stiffness;
    const halfWeight = (given.density * given.gravity * chord) / (2 * tension);
    const ratio = lengthRatio(halfWeight, sine, span / chord, strain);
    const taut = 1 - strain * ratio, h = halfWeight * taut, c = Math.cosh(h);
    const lever = c / (taut * sinhc(h) + strain * ratio * c);
    return state(given, chord * ratio, tension * (halfWeight * ratio + sine * lever));
  }

  /** Where a share of a cable ends, from its frame end: the first part of a cable is a cable. */
  function at(found, share) {
    const length = share * found.length;
    return endOf({ ...found, length, vertical: found.vertical - found.weight * (found.length - length) });
  }

  /** How far a cable hangs below its chord, at the most. */
  function sag(found) {
    const along = (found.tension * found.rise) / found.chord; // the vertical part of a force along the chord
    const deepest = at(found, Math.min(Math.max(1 - (found.vertical - along) / (found.weight * found.length), 0), 1));
    return Math.max((found.rise / found.span) * deepest.x - deepest.z, 0);
  }

  return { at, exact, sag, state };
})();
