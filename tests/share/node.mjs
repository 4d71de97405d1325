/* Run the package for JavaScript in node: node node.mjs MODULE < REQUEST. A request is JSON: machine, rows, repeat. */
import { readFileSync } from "node:fs";

const { load } = await import(process.argv[2]);
const { machine, rows, repeat } = JSON.parse(readFileSync(0, "utf-8"));
const sagline = await load();

/** Memory of the kernels after each call, for each row. */
async function images() {
  const of = await sagline.calls(machine.kernels), found = [], [[array, [, place]]] = Object.entries(machine.kernels.arrays);
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

/** Answers of the package, and microseconds an update: solved and drawn. */
async function answers() {
  const of = await sagline.robot(machine), none = machine.anchors.map(() => NaN);
  const poses = rows.map(({ pose }) => ({ position: pose.slice(0, 3), quaternion: pose.slice(3) }));
  const found = poses.map((pose, i) => {
    const { short, ...plan } = of.inverse(pose);
    const rest = rows[i].given ? of.forward(rows[i].given, pose) : null;
    return { ...plan, short: String(short), rest, courses: of.courses(pose, plan.tension ?? none) };
  });
  const times = { inverse: [], forward: [], courses: [] };
  for (let k = 0; k < repeat; k++)
    for (const [name, work] of Object.entries({
      inverse: (pose) => of.inverse(pose),
      forward: (pose, i) => of.forward(rows[i].given, pose),
      courses: (pose, i) => of.courses(pose, found[i].tension ?? none),
    })) {
      const from = performance.now();
      poses.forEach(work);
      times[name].push((1e3 * (performance.now() - from)) / poses.length);
    }
  process.stdout.write(JSON.stringify({ found, times }));
}

await (repeat === undefined ? images() : answers());
