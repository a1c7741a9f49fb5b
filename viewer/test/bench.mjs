// How long the page takes, in a headless Chromium with SwiftShader at 1280 x 720: `npm run bench`. Machines are shared, so that
// processor time of all of Chromium's processes is told beside wall time.
import { readdirSync, readFileSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { Session } from './browser.mjs';
import { fillPage, sampleView } from './sample.mjs';

const kTicks = 100;  // of /proc a second
const page = await readFile(new URL('../dist/viewer.html', import.meta.url), 'utf8');

/** Processor seconds of this process's descendants. */
function busy() {
  const parents = new Map();
  const seconds = new Map();
  for (const pid of readdirSync('/proc').filter((name) => /^[0-9]+$/.test(name))) {
    try {
      const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').replace(/^.*\) /, '').split(' ');
      parents.set(pid, fields[1]);
      seconds.set(pid, (Number(fields[11]) + Number(fields[12])) / kTicks);
    } catch {
      // It has ended.
    }
  }
  const own = (pid) => (pid === String(process.pid) ? true : parents.has(pid) ? own(parents.get(pid)) : false);
  return [...seconds].filter(([pid]) => pid !== String(process.pid) && own(pid)).reduce((sum, [, s]) => sum + s, 0);
}

async function timed(count, run) {
  const [cpu, wall] = [busy(), performance.now()];
  await run(count);
  return `${((1000 * (busy() - cpu)) / count).toFixed(0)} ms of processor time, ${((performance.now() - wall) / count).toFixed(0)} ms`;
}

for (const grid of process.argv.slice(2).map(Number).concat(process.argv.length > 2 ? [] : [8, 142])) {
  const html = fillPage(page, sampleView({ grid }));
  const begun = performance.now();
  const s = await Session.open(html);
  console.log(`${grid * grid} buildings, open after ${((performance.now() - begun) / 1000).toFixed(1)} s with the browser's start`);
  const turn = (count) => s.run(async (n) => {
    const { scene } = window.canyon;
    scene.measuring = true;
    for (let i = 0; i < n; ++i) {
      scene.control.azimuth += 1;
      scene.request();
      scene.frame();
      await new Promise((done) => requestAnimationFrame(done));
    }
    scene.measuring = false;
  }, count);
  await turn(5);
  console.log(`  a picture, camera following: ${await timed(40, turn)}`);
  await s.run(() => {
    const { scene, state } = window.canyon;
    state.camera = 'free';
    state.changed('camera');
    scene.control.distance = 1.1 * Math.max(scene.city.high[0] - scene.city.low[0], 300);
  });
  await turn(5);
  console.log(`  a picture of the whole city: ${await timed(20, turn)}`);
  console.log(`  drawn: ${JSON.stringify(await s.run('window.canyon.scene.drawn'))}`);
  const heap = await s.run('performance.memory.usedJSHeapSize');
  console.log(`  JavaScript heap: ${(heap / 1e6).toFixed(0)} MB`);
  await s.close();
}
process.exit(0);
