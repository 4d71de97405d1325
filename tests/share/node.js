/* Run the scripts of a shared page in node: node node.js SCRIPTS < REQUEST. A request is JSON: module, machine, rows. */
"use strict";

const { readFileSync } = require("node:fs"), vm = require("node:vm");

const { kernels, robot } = vm.runInThisContext(`${readFileSync(process.argv[2], "utf-8")}; ({ kernels, robot })`);
const { module: text, machine, rows, repeat } = JSON.parse(readFileSync(0, "utf-8"));

/** Memory of the kernels after each call, for each row. */
async function images() {
  const of = await kernels.made(text, machine.kernels), found = [], [[array, [, place]]] = Object.entries(machine.kernels.arrays);
  const memory = new Uint8Array(of[array].buffer, of[array].byteOffset - place, machine.kernels.size);
  for (const row of rows) {
    for (const [name, numbers] of Object.entries(row)) of[name].set(numbers);
    for (const name of Object.keys(machine.kernels.calls)) {
      of[name]();
      found.push(Uint8Array.from(memory));
    }
  }
  process.stdout.write(Buffer.concat(found));
}

/** Answers of robot.js, and microseconds an update: solved and drawn. */
async function answers() {
  const of = robot.made(machine, await kernels.made(text, machine.kernels));
  const poses = rows.map(({ pose }) => robot.posed(pose.slice(0, 3), pose.slice(3)));
  const found = poses.map((pose, i) => {
    const { short, ...balanced } = of.balanced(pose), straight = machine.anchors.map(() => NaN);
    const rest = rows[i].given ? of.atRest(rows[i].given, pose) : null;
    return { ...balanced, short: String(short), rest, courses: of.courses(pose, balanced.tension ?? straight) };
  });
  const tensions = found.map(({ tension }) => tension ?? machine.anchors.map(() => NaN)), times = { balanced: [], atRest: [], courses: [] };
  for (let k = 0; k < repeat; k++)
    for (const [name, work] of Object.entries({
      balanced: (pose) => of.balanced(pose),
      atRest: (pose, i) => of.atRest(rows[i].given, pose),
      courses: (pose, i) => of.courses(pose, tensions[i]),
    })) {
      const from = performance.now();
      poses.forEach(work);
      times[name].push((1e3 * (performance.now() - from)) / poses.length);
    }
  process.stdout.write(JSON.stringify({ found, times }));
}

repeat === undefined ? images() : answers();
